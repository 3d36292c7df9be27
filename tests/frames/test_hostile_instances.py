"""Files of instances that the step ``instances`` did not write, as the step ``frame_registrations`` reads them."""

import json
from dataclasses import fields

import numpy as np
import pytest

from gpca.frames.instances import Instances
from gpca.io.arrays import save_arrays

from ..hostile import refusal

OUTPUTS = ["--out", "seed0.npz", "--poses", "poses.csv", "--timings", "timings.csv"]
SETTINGS = json.dumps({"train": 9, "test": 6, "cloud_points": 128})
CALL = ["frame_registrations", "--instances", "instances.npz", "--objects", "objects.npz", "--source", "tiny"]
CALL += ["--seed", "0", "--settings", SETTINGS, *OUTPUTS]


@pytest.fixture(scope="module")
def objects_file(tiny, tmp_path_factory):
    path = tmp_path_factory.mktemp("instances") / "objects.npz"
    tiny[1].save(path, "tiny")
    return path


@pytest.fixture
def folder(objects_file, tmp_path):
    (tmp_path / "objects.npz").write_bytes(objects_file.read_bytes())
    return tmp_path


def put(value, *where):
    """Return a change that sets one entry."""

    def change(array):
        array = array.copy()
        array[where] = value
        return array

    return change


ARRAYS = {
    "an object that is not there": ("object_index", put(99, 0), "objects that the object file does not contain"),
    "a negative object": ("object_index", put(-1, 0), "objects that the object file does not contain"),
    "objects as fractions": ("object_index", lambda a: a + 0.5, "array 'object_index' has type float64"),
    "objects as words": ("object_index", lambda a: a.astype(str), "array 'object_index' has type <U"),
    "poses in millimetres": (
        "T_camera_object_true",
        lambda a: a * ([[1e0, 1, 1, 1e3]] * 3 + [[1] * 4]),
        "was measured",
    ),
    "poses of zeros": (
        "T_camera_object_true",
        lambda a: 0 * a,
        "instance 0, T_camera_object_true: the pose is not a rigid",
    ),
    "poses mirrored": (
        "T_camera_object_init",
        lambda a: a * [[[-1, 1, 1, 1]]],
        "it is mirrored: its determinant is -1",
    ),
    "a pose of NaN": ("T_camera_object_init", put(np.nan, 3, 0, 0), "'T_camera_object_init' contains NaN"),
    "a pose of another last row": ("T_camera_object_init", put(5, 2, 3, 0), "its last row must be 0 0 0 1"),
    "complex poses": ("T_camera_object_true", lambda a: a + 0j, "has type complex128"),
    "a focal length below zero": ("camera_3_3", put(-5, 1, 0, 0), "instance 1, camera_3_3: has the focal lengths -5"),
    "points in millimetres": ("points_m", lambda a: 1000 * a, "was measured"),
    "points all equal": ("points_m", lambda a: 0 * a, "was measured"),
    "points of infinity": ("points_m", put(np.inf, 0, 0), "'points_m' contains NaN or infinity"),
    "fewer pixels than points": ("pixels", lambda a: a[:-1], "array 'pixels' is"),
    "negative pixels": ("pixels", put(-1, 0, 0), "'pixels' lie outside any image"),
    "pixels that would fill the memory": ("pixels", put(2**31 - 1, 0), "'pixels' lie outside any image"),
    "offsets backwards": ("offsets", lambda a: a[::-1], "'offsets' do not match"),
    "one scene": ("scene", lambda a: 0 * a, "all are from one scene"),
    "symmetry as words": ("symmetric", lambda a: a.astype(str), "array 'symmetric' has type <U"),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_instances_that_cannot_be(tiny, folder, name):
    array, change, words = ARRAYS[name]
    arrays = {field.name: getattr(tiny[0], field.name) for field in fields(Instances)}
    save_arrays(folder / "instances.npz", arrays | {array: change(arrays[array])}, ("tiny", None))
    refusal(CALL, folder, words)


@pytest.mark.parametrize("content", [b"", b"PK", b"scene,image\n1,2\n"])
def test_a_file_that_holds_no_instances(folder, content):
    (folder / "instances.npz").write_bytes(content)
    found = "is not a readable npz archive; regenerate it" if content else "is empty; make it"
    refusal(CALL, folder, f"instances.npz: {found}")


def test_no_file_of_instances(folder):
    refusal(CALL, folder, "instances.npz: no such file; make it with")


def test_instances_beside_the_objects_of_another_source(tiny, objects, folder):
    tiny[0].save(folder / "instances.npz", "tiny")
    objects.save(folder / "objects.npz", "other")
    refusal(CALL, folder, "objects.npz: is of source 'other', not of source 'tiny'")
    objects.save(folder / "objects.npz", "tiny")
    refusal(CALL, folder, "instances.npz", "regenerate both files")
