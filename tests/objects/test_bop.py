"""Lists of models, ``models_info.json``, that say what cannot be, through the command line."""

import json

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from gpca.errors import InputError
from gpca.objects import bop
from gpca.objects.canonical import canonical_cloud
from gpca.objects.surface import Surface

from ..hostile import refusal
from .test_mesh_folder import MESHES, arguments, ply


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


def test_all_models_or_those_that_are_listed_are_read_in_metres(folder):
    found = list(bop.from_entry({}, folder))
    assert [surface.name for surface in found] == ["obj_000001", "obj_000002", "obj_000010"]
    assert np.ptp(found[0].vertices_m, axis=0) == pytest.approx([0.031, 0.04, 0.12])
    for place in (folder / "models", folder.parent):
        assert len(list(bop.from_entry({}, place))) == 3
    found = list(bop.from_entry({"objects": [10, 1]}, folder))
    assert [surface.name for surface in found] == ["obj_000001", "obj_000010"]
    with pytest.raises(InputError, match=r"obj_000003\.ply: no such model"):
        list(bop.from_entry({"objects": [1, 3]}, folder))
    for read in (bop.from_entry, bop.require_entry):
        with pytest.raises(InputError, match="objects: is an empty list; name the objects, or leave it out for all"):
            read({"objects": []}, folder)


def test_unit_is_checked_against_the_listed_diameter(folder):
    for unit in ("m", "cm"):
        with pytest.raises(InputError, match=rf"obj_000001\.ply: .* in unit {unit}, .*check unit"):
            list(bop.from_entry({"unit": unit}, folder))


@pytest.mark.parametrize(("factor", "passes"), [(1.04, True), (1.06, False), (0.94, False)])
def test_tolerance_of_the_diameter(folder, factor, passes):
    path = folder / "models" / "models_info.json"
    info = json.loads(path.read_text())
    info["2"]["diameter"] *= factor
    path.write_text(json.dumps(info))
    if passes:
        assert len(list(bop.from_entry({}, folder))) == 3
    else:
        with pytest.raises(InputError, match="obj_000002"):
            list(bop.from_entry({}, folder))


@pytest.mark.parametrize("name", ["obj_1_0.ply", "obj_1٣.ply", "obj_000001_old.ply"])
def test_a_model_without_a_plain_number_in_its_name(folder, name):
    (folder / "models" / name).write_bytes((folder / "models/obj_000001.ply").read_bytes())
    with pytest.raises(InputError, match=rf"{name}: is not named obj_\{{number\}}\.ply; name it like"):
        list(bop.from_entry({}, folder))


def test_missing_and_empty_folder(folder, tmp_path):
    (folder / "models/models_info.json").unlink()
    with pytest.raises(InputError, match=r"models_info\.json: no such file"):
        list(bop.from_entry({}, folder))
    with pytest.raises(InputError, match="nowhere: no such folder"):
        list(bop.from_entry({}, tmp_path / "nowhere"))
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="has no models"):
        list(bop.from_entry({}, tmp_path / "empty"))


create = trimesh.creation


def symmetries(mesh):
    points, _, diameter = canonical_cloud(Surface("object", mesh.vertices, mesh.faces), "tests", 4096)
    return bop.find_symmetries(points, diameter)


def test_a_brick_may_be_turned_over_but_not_by_a_quarter():
    found = symmetries(create.box((0.06, 0.09, 0.14)))
    assert set(found) == {"symmetries_discrete"}
    turns = [np.reshape(T, (4, 4)) for T in found["symmetries_discrete"]]
    assert sorted(np.diag(T).astype(int).tolist() for T in turns) == [[-1, -1, 1, 1], [-1, 1, -1, 1], [1, -1, -1, 1]]


@pytest.mark.parametrize("mesh", [create.cone(0.05, 0.13), create.cylinder(0.04, 0.12)], ids=["cone", "cylinder"])
def test_a_body_of_revolution_is_symmetric_about_its_axis(mesh):
    found = symmetries(mesh)
    assert found["symmetries_continuous"] == [{"axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.0]}]


def test_a_handle_takes_the_symmetry_away():
    handle = create.box((0.05, 0.015, 0.07))
    handle.apply_translation((0.06, 0, 0))
    found = symmetries(trimesh.util.concatenate([create.cylinder(0.04, 0.1), handle]))
    (over,) = found.pop("symmetries_discrete")  # turned over about the handle
    assert np.diag(np.reshape(over, (4, 4))).tolist() == [1, -1, -1, 1]
    assert found == {}


def test_what_the_file_lists_counts_for_all_of_its_objects():
    info = {1: {"diameter": 1.0}, 2: {"diameter": 1.0, "symmetries_discrete": [[1]]}}
    assert bop.read_symmetries(info, 1) == {}
    assert bop.read_symmetries(info, 2) == {"symmetries_discrete": [[1]]}
    assert bop.read_symmetries({1: {"diameter": 1.0}}, 1) is None


def turn(axis, angle_deg):
    return Rotation.from_rotvec(np.deg2rad(angle_deg) * np.asarray(axis, float)).as_matrix()


def discrete(*turns):
    """As BOP writes them, row by row."""
    return {"symmetries_discrete": [np.pad(R, (0, 1)).ravel().tolist() for R in turns]}


def test_an_angle_is_counted_from_the_nearest_turn_that_changes_nothing():
    assert bop.angle_up_to_symmetry(turn([0, 0.6, 0.8], 70), {}) == pytest.approx(np.deg2rad(70))
    assert bop.angle_up_to_symmetry(np.eye(3), {}) == pytest.approx(0, abs=1e-7)
    square_bar = discrete(turn([0, 0, 1], 90), turn([1, 0, 0], 180))
    for angle, expected in ((80, 10), (-80, 10), (130, 40), (45, 45)):  # three quarters too, which no list has
        assert bop.angle_up_to_symmetry(turn([0, 0, 1], angle), square_bar) == pytest.approx(np.deg2rad(expected))
    over_a_diagonal = turn(np.array([1, 1, 0]) / 2**0.5, 180)  # the two after each other
    assert bop.angle_up_to_symmetry(over_a_diagonal, square_bar) == pytest.approx(0, abs=1e-6)
    assert bop.angle_up_to_symmetry(turn([1, 0, 0], 90), square_bar) == pytest.approx(np.pi / 2)


def test_turns_about_an_axis_of_revolution_do_not_count_and_the_least_angle_is_left():
    cone = {"symmetries_continuous": [{"axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.0]}]}
    tilted = turn([1, 0, 0], 25)
    angles = [bop.angle_up_to_symmetry(tilted @ turn([0, 0, 1], angle), cone) for angle in (0, 77, 180)]
    np.testing.assert_allclose(angles, np.deg2rad(25))
    cylinder = cone | discrete(turn([1, 0, 0], 180))
    assert bop.angle_up_to_symmetry(turn([0, 1, 0], 170), cone) == pytest.approx(np.deg2rad(170))
    assert bop.angle_up_to_symmetry(turn([0, 1, 0], 170), cylinder) == pytest.approx(np.deg2rad(10))
    axis = np.array([2.0, -1.0, 2.0]) / 3
    found = {"symmetries_continuous": [{"axis": axis.tolist()}]}
    random = np.random.default_rng(0)
    for R in Rotation.random(5, rng=random):
        least = min((R * Rotation.from_rotvec(angle * axis)).magnitude() for angle in np.linspace(0, 2 * np.pi, 2001))
        assert bop.angle_up_to_symmetry(R.as_matrix(), found) == pytest.approx(least, abs=1e-3)


def test_the_turn_that_leaves_the_least_angle_is_a_symmetry():
    cone = {"symmetries_continuous": [{"axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.0]}]}
    shapes = {"none": {}, "bar": discrete(turn([0, 0, 1], 90), turn([1, 0, 0], 180)), "cone": cone}
    shapes["cylinder"] = cone | discrete(turn([1, 0, 0], 180))
    for name, symmetries in shapes.items():
        for R in Rotation.random(5, rng=np.random.default_rng(0)).as_matrix():
            S = bop.symmetric_turn(R, symmetries)
            left = Rotation.from_matrix(R @ S).magnitude()
            assert left == pytest.approx(bop.angle_up_to_symmetry(R, symmetries), abs=1e-6), name
            assert bop.angle_up_to_symmetry(S, symmetries) == pytest.approx(0, abs=1e-6), name
    ball = {"symmetries_continuous": [{"axis": [1.0, 0.0, 0.0]}, {"axis": [0.0, 1.0, 0.0]}]}
    R = turn([0, 0, 1], 50)
    np.testing.assert_allclose(R @ bop.symmetric_turn(R, ball), np.eye(3), atol=1e-12)


INFOS = [
    *("", "{", "[]", "[100.0]", "[" * 10**6, "\0"),
    *('{"1": {}}', '{"1": {"diameter": NaN}}', '{"1": {"diameter": -100}}'),
    *('{"1": {"diameter": 0.1}}', '{"2": {"diameter": 100}}', '{"0_1": {"diameter": 131}}'),
    *('{"1": {"diameter": "1_31"}}', '{"one": {"diameter": 1}}', '{"1": {"diameter": 100}, "01": {"diameter": 100}}'),
]


def models(folder, info):
    (folder / "models").mkdir()
    (folder / "models/obj_000001.ply").write_text(ply())
    (folder / "models/models_info.json").write_text(info)


@pytest.mark.parametrize("text", INFOS)
def test_a_list_of_models_that_cannot_be(text, tmp_path):
    models(tmp_path, text)
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


def test_a_model_wider_than_its_rows_say_is_refused(tmp_path):
    models(tmp_path, json.dumps({"1": {"diameter": 100.0}}))
    (tmp_path / "models/obj_000001.ply").write_text(MESHES["one_wide.ply"])
    refusal(arguments("bop"), tmp_path, "obj_000001.ply", "row 6 of 162")
