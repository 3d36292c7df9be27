"""Lists of models, ``models_info.json``, that say what cannot be, through the command line."""

import json

import pytest

from ..hostile import refusal
from .test_hostile_meshes import MESHES, arguments, ply

INFO = {"1": {"diameter": 100.0}}
INFOS = {
    "NaN": {"1": {"diameter": float("nan")}},
    "negative": {"1": {"diameter": -100}},
    "metres": {"1": {"diameter": 0.1}},
    "none": {"1": {}},
    "list": [100.0],
    "other": {"2": {"diameter": 100.0}},
}


def models(folder, info):
    (folder / "models").mkdir()
    (folder / "models/obj_000001.ply").write_text(ply())
    (folder / "models/models_info.json").write_text(info)


@pytest.mark.parametrize("fault", INFOS)
def test_a_list_of_models_that_cannot_be(fault, tmp_path):
    models(tmp_path, json.dumps(INFOS[fault]))
    refusal(arguments("bop"), tmp_path, "models_info.json", "again")


TURN = [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1]  # half a turn about x
SYMMETRIES = {
    "mirrored": ("discrete", [TURN, [-1, *TURN[1:]]], "discrete 1: is not a rotation and a shift"),
    "another last row": ("discrete", [[*TURN[:12], 1, 0, 0, 1]], "is not a rotation and a shift"),
    "NaN": ("discrete", [[float("nan"), *TURN[1:]]], "NaN is not a number"),
    "huge": ("discrete", [[10**400, *TURN[1:]]], "contains a number that is not finite"),
    "a matrix alone": ("discrete", TURN, "has 1 numbers, not 16"),
    "a word": ("discrete", "none", "is not a list"),
    "no axis": ("continuous", [{"offset": [0, 0, 0]}], "axis contains None, which is not a number"),
    "an axis of zeros": ("continuous", [{"axis": [0, 0, 0], "offset": [0, 0, 0]}], "axis has no direction"),
    "a list for an axis": ("continuous", [[0, 0, 1]], "axis contains None, which is not a number"),
}


@pytest.mark.parametrize("fault", SYMMETRIES)
def test_a_symmetry_that_is_no_rigid_transform(fault, tmp_path):
    kind, value, words = SYMMETRIES[fault]
    models(tmp_path, json.dumps({"1": {"diameter": 100.0, f"symmetries_{kind}": value}}))
    refusal(arguments("bop"), tmp_path, "models_info.json", words, ";" if fault != "NaN" else "")


@pytest.mark.parametrize("text", ["", "{", "[" * 10**6, "\0", '{"1": {"diameter": 100}, "01": {"diameter": 100}}'])
def test_a_list_of_models_that_is_no_json(text, tmp_path):
    models(tmp_path, text)
    refusal(arguments("bop"), tmp_path, "models_info.json", "again")


def test_a_model_wider_than_its_rows_say_is_refused(tmp_path):
    models(tmp_path, json.dumps(INFO))
    (tmp_path / "models/obj_000001.ply").write_text(MESHES["one_wide.ply"])
    refusal(arguments("bop"), tmp_path, "obj_000001.ply", "row 6 of 162")
