"""Results files that no estimator meant."""

import json

import numpy as np
import pytest

from ..hostile import refusal
from ..steps.by_words import main
from .damage import instances

HEAD = "scene_id,im_id,obj_id,score,R,t,time"


@pytest.fixture(scope="module")
def lines(scenes):
    """The true poses of the tiny dataset as an estimator would write them."""
    found = []
    for path in sorted(scenes.rglob("scene_gt.json")):
        for image, entries in json.loads(path.read_text()).items():
            for entry in entries:
                R, t = (" ".join(map(repr, entry[key])) for key in ("cam_R_m2c", "cam_t_m2c"))
                found.append([str(int(path.parent.name)), image, str(entry["obj_id"]), "1.0", R, t, "-1"])
    return found


@pytest.fixture
def call(damaged, lines):
    """Return a function that damages the results file and the arguments that read it."""

    def write(change=None, content=None, head=HEAD):
        rows = [list(line) for line in lines]
        if change:
            change(rows)
        text = "\n".join([head, *(",".join(row) for row in rows)]) + "\n" if content is None else content
        encoded = text if isinstance(text, bytes) else text.encode()
        (damaged.parent / "results.csv").write_bytes(encoded)
        entry = {"location": "tiny", "results": "results.csv"}
        given = {"initial_pose": {"form": "results"}, "datasets": {"tiny": entry}}
        return [*instances(given, scenes=None), "--data-dir", str(damaged.parent)]

    return write


def one(column, value):
    def change(rows):
        rows[2][column] = value

    return change


def scaled(factor, only=slice(None)):
    def change(rows):
        for row in rows[only]:
            row[5] = " ".join(repr(factor * float(value)) for value in row[5].split())

    return change


ROWS = {
    "t in metres": (scaled(1e-3), "is t in meters? the format requires millimeters"),
    "one t in metres": (scaled(1e-3, slice(3, 4)), "line 5: t is"),
    "t in centimetres": (scaled(0.1), "is t in centimeters? the format requires millimeters"),
    "t of zeros": (one(5, "0 0 0"), "line 4: t has z = 0 mm, not in front of the camera"),
    "t behind": (scaled(-1), "line 2: t has z = -"),
    "t infinite": (one(5, "0 0 inf"), "line 4: t contains values that are not finite numbers"),
    "t huge": (one(5, "0 0 1e90"), "line 4: t is"),
    "t of two": (one(5, "0 700"), "line 4: t has 2 entries, not 3"),
    "t in other digits": (one(5, "0 0 ٧٠٠"), "line 4: t contains values that are not"),
    "R of zeros": (one(4, "0 0 0 0 0 0 0 0 0"), "line 4: the pose is not a rigid transform: its axes are not"),
    "R mirrored": (one(4, "1 0 0 0 1 0 0 0 -1"), "line 4: the pose is not a rigid transform: it is mirrored"),
    "R scaled": (one(4, "2 0 0 0 2 0 0 0 2"), "not orthogonal or not of unit length"),
    "R a quaternion": (one(4, "1 0 0 0"), "line 4: R has 4 entries, not 9"),
    "score NaN": (one(3, "nan"), "line 4: score contains values that are not finite numbers"),
    "score missing": (one(3, ""), "line 4: score has 0 entries, not 1"),
    "score with NUL": (one(3, "1\0"), "line 4: column 'score' contains a line break or another control"),
    "object unknown": (one(2, "77"), "line 4: the dataset has no object 77"),
    "object negative": (one(2, "-1"), "line 4: obj_id is '-1', not a whole number"),
    "object without end": (one(2, "9" * 5000), "line 4: obj_id is '999"),
    "image unknown": (one(1, "999"), "line 4: the dataset has no image 999"),
    "a row too long": (lambda rows: rows[2].append("1"), "results.csv"),
    "a row too short": (lambda rows: rows[2].__delitem__(slice(3, None)), "line 4: score has 0 entries"),
    "no rows": (lambda rows: rows.clear(), "has no rows"),
    "of another dataset": (lambda rows: [row.__setitem__(0, "50") for row in rows], "of scene 50"),
}


@pytest.mark.parametrize("name", ROWS)
def test_a_row_that_cannot_be(call, damaged, name):
    change, words = ROWS[name]
    refusal(call(change), damaged.parent, "results.csv", words, ";")


HEADS = {
    "column missing": (HEAD.replace("score", "confidence"), "column 'score' is missing"),
    "column twice": (HEAD.replace("time", "t"), "column 't' appears twice"),
    "no head": ("1,0,1,1.0,1 0 0 0 1 0 0 0 1,0 0 700,-1", "column 'scene_id' is missing"),
    "semicolons": (HEAD.replace(",", ";"), "results.csv"),
}


@pytest.mark.parametrize("name", HEADS)
def test_a_head_that_is_none(call, damaged, name):
    head, words = HEADS[name]
    refusal(call(head=head), damaged.parent, "results.csv", words, ";")


FILES = {
    "empty": (b"", "is empty"),
    "blank": (b"\n\n\n", "results.csv"),
    "UTF-16": (HEAD.encode("utf-16"), "is not a readable CSV file"),
    "Latin-1": (f"{HEAD}\n1,0,1,1.0,é,0 0 1,-1\n".encode("latin-1"), "is not a readable CSV file"),
    "NUL bytes": (b"\0" * 999, "column 'scene_id' is missing"),
    "an open quote": (f'{HEAD}\n"1,0,1,1.0\n'.encode(), "is not a readable CSV file"),
    "JSON": (b'{"scene_id": 1}', "column 'scene_id' is missing"),
    "an archive": (b"PK\x03\x04" + bytes(range(256)), "results.csv"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_no_results_file(call, damaged, name):
    content, words = FILES[name]
    refusal(call(content=content), damaged.parent, "results.csv", words, ";")


def test_a_folder_in_place_of_results(call, damaged):
    arguments = call()
    (damaged.parent / "results.csv").unlink()
    (damaged.parent / "results.csv").mkdir()
    refusal(arguments, damaged.parent, "results.csv: no such results file")


def test_no_results_where_poses_come_from_them(damaged):
    given = {"initial_pose": {"form": "results"}, "datasets": {"tiny": {"location": str(damaged)}}}
    refusal(instances(given, scenes=None), damaged.parent, "dataset tiny: has no results file; set results")


def test_good_results_are_read(call, damaged, lines, capsys):
    from gpca.frames.instances import Instances

    def add(rows):
        rows += [[*row[:3], "-0.5", "1 0 0 0 1 0 0 0 1", "1e2 -2.5E1 2000.", ""] for row in rows[:2]]  # a bad guess

    outputs = {name: str(damaged.parent / name) for name in ("instances.npz", "objects.npz")}
    assert main([outputs.get(argument, argument) for argument in call(add)]) == 0
    read = Instances.load(outputs["instances.npz"])
    assert np.allclose(read.T_camera_object_init, read.T_camera_object_true, atol=1e-9)
    assert len(read) + capsys.readouterr().err.count("skipped") == len(lines)
