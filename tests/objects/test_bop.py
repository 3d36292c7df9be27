import json

import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.objects.bop import from_entry, surfaces


@pytest.fixture
def folder(tmp_path):
    """Three boxes, ids 1, 2 and 10, in the layout of BOP."""
    models = tmp_path / "toy" / "models"
    models.mkdir(parents=True)
    info = {}
    for number in (1, 2, 10):
        box = trimesh.creation.box((30.0 + number, 40.0, 120.0))
        box.export(models / f"obj_{number:06d}.ply")
        info[str(number)] = {"diameter": float(np.linalg.norm(box.extents)), "min_x": 0.0}
    (models / "models_info.json").write_text(json.dumps(info))
    return tmp_path / "toy"


def test_all_models_in_metres(folder):
    found = list(surfaces(folder))
    assert [surface.name for surface in found] == ["obj_000001", "obj_000002", "obj_000010"]
    assert np.ptp(found[0].vertices_m, axis=0) == pytest.approx([0.031, 0.04, 0.12])


def test_folder_of_the_models_or_above_an_unpacked_set(folder):
    for place in (folder / "models", folder.parent):
        assert len(list(surfaces(place))) == 3


def test_listed_objects_only(folder):
    found = list(from_entry({"objects": [10, 1]}, folder))
    assert [surface.name for surface in found] == ["obj_000001", "obj_000010"]
    with pytest.raises(InputError, match=r"obj_000003\.ply: no such model"):
        list(from_entry({"objects": [1, 3]}, folder))


def test_unit_is_checked_against_the_listed_diameter(folder):
    for unit in ("m", "cm"):
        with pytest.raises(InputError, match=rf"obj_000001\.ply: .* in unit {unit}, .*check unit"):
            list(surfaces(folder, unit))


@pytest.mark.parametrize(("factor", "passes"), [(1.04, True), (1.06, False), (0.94, False)])
def test_tolerance_of_the_diameter(folder, factor, passes):
    path = folder / "models" / "models_info.json"
    info = json.loads(path.read_text())
    info["2"]["diameter"] *= factor
    path.write_text(json.dumps(info))
    if passes:
        assert len(list(surfaces(folder))) == 3
    else:
        with pytest.raises(InputError, match="obj_000002"):
            list(surfaces(folder))


@pytest.mark.parametrize(
    "content",
    [
        None,
        "{",
        "[]",
        '{"1": {}}',
        '{"0_1": {"diameter": 131}}',
        '{"1": {"diameter": "1_31"}}',
        '{"one": {"diameter": 1}}',
        '{"1": {"diameter": 131}}',
    ],
)
def test_bad_models_info(folder, content):
    path = folder / "models" / "models_info.json"
    path.unlink() if content is None else path.write_text(content)
    with pytest.raises(InputError, match=r"models_info\.json"):
        list(surfaces(folder))


@pytest.mark.parametrize("name", ["obj_1_0.ply", "obj_1٣.ply", "obj_000001_old.ply"])
def test_a_model_without_a_plain_number_in_its_name(folder, name):
    (folder / "models" / name).write_bytes((folder / "models/obj_000001.ply").read_bytes())
    with pytest.raises(InputError, match=rf"{name}: is not named obj_\{{number\}}\.ply; name it like"):
        list(surfaces(folder))


def test_missing_and_empty_folder(tmp_path):
    with pytest.raises(InputError, match="nowhere: no such folder"):
        list(surfaces(tmp_path / "nowhere"))
    with pytest.raises(InputError, match="has no models"):
        list(surfaces(tmp_path))
