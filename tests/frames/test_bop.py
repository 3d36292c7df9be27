"""Scenes whose JSON files no camera and no annotator wrote: each is refused by the command line."""

import json
import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from gpca.errors import InputError
from gpca.frames import bop
from gpca.frames.dataset import Dataset, read_models

from ..hostile import refusal
from .damage import CAMERA, SCENE, TRUTH, edit, instances, save
from .tiny import read

TABLE = "test/000001"  # the scene, below the folder of the dataset


def test_pixels_are_projected_back_but_for_what_lies_a_diameter_behind_the_object(tmp_path):
    depth_m = np.zeros((4, 5), np.float32)
    depth_m[1, 3] = 2.0
    camera_3_3 = np.array([[10.0, 0, 2], [0, 20, 3], [0, 0, 1]])
    points, pixels = bop.back_project(depth_m, np.ones((4, 5), bool), camera_3_3)
    assert points.tolist() == [[(3 - 2) / 10 * 2, (1 - 3) / 20 * 2, 2.0]]
    assert pixels.tolist() == [[3, 1]]
    save(tmp_path / "mask.png", np.full((20, 20), 255, np.uint8))
    frame = bop.Frame(0, 0, np.array([[100.0, 0, 10], [0, 100, 10], [0, 0, 1]]), 1.0, None, None, ())
    depth_m = np.full((20, 20), 1.0, np.float32)
    depth_m[:, :3] = 1.5  # seen past its edge
    annotation = bop.Annotation(1, np.eye(4), tmp_path / "mask.png", "scene_gt.json")
    points, _ = bop.without_background(*bop.measured_points(frame, annotation, depth_m), annotation, diameter_m=0.3)
    assert len(points) == 20 * 17
    assert points[:, 2].max() == 1.0


def test_frames_are_found_in_any_archive_of_the_dataset_and_may_be_a_draw(scenes, tmp_path):
    assert len(bop.read_frames([tmp_path, scenes])) == 6
    few = Dataset("tiny", (scenes,), most_frames=3).frames()
    assert [(frame.scene, frame.image) for frame in few] == [
        (frame.scene, frame.image) for frame in Dataset("tiny", (scenes,), most_frames=3).frames()
    ]
    assert len(few) == 3


def test_colour_may_be_jpeg(damaged):
    for path in (damaged / TABLE / "rgb").iterdir():
        Image.open(path).save(path.with_suffix(".jpg"))
        path.unlink()
    assert {frame.color.suffix for frame in bop.read_frames([damaged])} == {".png", ".jpg"}


def test_an_object_of_which_little_was_measured_is_left_out_and_named(tiny, damaged, tmp_path, capsys):
    mask = damaged / TABLE / "mask_visib/000000_000001.png"
    pixels = np.zeros((120, 160), np.uint8)
    pixels[60, 40:70] = 255
    save(mask, pixels)
    instances, _ = read(damaged, tmp_path / "objects.npz")
    assert f"skipped: {mask}: has depth at" in (told := capsys.readouterr().err)
    assert "64 are needed" in told
    assert len(instances) == len(tiny[0]) - 1
    frame = next(frame for frame in bop.read_frames([damaged]) if (frame.scene, frame.image) == (1, 0))
    with pytest.raises(bop.TooFewPoints, match="000000_000001"):
        bop.measured_points(frame, frame.annotations[1], frame.depth_m())


def edited(name, change):
    return lambda folder: edit(folder / TABLE / f"scene_{name}.json", change)


FAULTS = {
    "no depth": (lambda f: (f / TABLE / "depth/000001.png").unlink(), "depth/000001.png: no such image"),
    "no mask": (lambda f: (f / TABLE / "mask_visib/000000_000002.png").unlink(), "000000_000002.png: no such image"),
    "no camera": (lambda f: (f / TABLE / "scene_camera.json").unlink(), "scene_camera.json: no such file"),
    "half unpacked": (lambda f: [p.unlink() for p in (f / TABLE / "depth").iterdir()], "may be half unpacked"),
    "camera of another image": (edited("camera", lambda c: c.pop("1")), "scene_camera.json: has no image 1"),
    "camera without K": (edited("camera", lambda c: c["1"].pop("cam_K")), "scene_camera.json: image 1: has no cam_K"),
    "unknown object": (edited("gt", lambda g: g["0"][0].update(obj_id=77)), "scenes: object 77: has no model in"),
    "no models": (lambda f: [p.unlink() for p in (f / "models").glob("*.ply")], "has no models/obj_"),
}


def test_models_and_frames_may_come_in_archives_of_their_own(scenes, tmp_path):
    for part in ("models", "test"):
        shutil.copytree(scenes / part, tmp_path / f"tiny_{part}" / part)
    folders = (tmp_path / "tiny_models", tmp_path / "tiny_test")
    apart, whole = Dataset("tiny", folders), Dataset("tiny", (scenes,))
    assert [frame.depth.name for frame in apart.frames()] == [frame.depth.name for frame in whole.frames()]
    models = read_models(apart, apart.frames())
    assert models.keys() == read_models(whole, whole.frames()).keys()
    with pytest.raises(InputError, match="has no models/obj_"):
        read_models(Dataset("tiny", folders[1:]), apart.frames())


def camera_values(focal_px=150.0, u=79.5, v=59.5, y=150.0, below=0, last=(0, 0, 1)):
    return [focal_px, 0, u, below, y, v, *last]


CAMERAS = {
    "no focal length": ("cam_K", camera_values(0), "focal lengths 0 and 150 px"),
    "NaN": ("cam_K", camera_values(math.nan), "NaN is not a number"),
    "rotated": ("cam_K", camera_values(below=3.0), "is not a camera matrix"),
    "principal point on the moon": ("cam_K", camera_values(u=1e9), "principal point outside any image"),
    "eight numbers": ("cam_K", camera_values()[:8], "cam_K has 8 numbers, not 9"),
    "a number for a list": ("cam_K", 150.0, "cam_K has 1 numbers, not 9"),
    "numbers as words": ("cam_K", ["150", *camera_values()[1:]], "cam_K contains '150', which is not a number"),
    "scale huge": ("depth_scale", 1e30, "depth_scale is 1e+30"),
}


POSES = {
    "R of zeros": ("cam_R_m2c", [0] * 9, "not orthogonal or not of unit length"),
    "R mirrored": ("cam_R_m2c", [-1, 0, 0, 0, 1, 0, 0, 0, 1], "it is mirrored: its determinant is -1"),
    "R a quaternion": ("cam_R_m2c", [0, 0, 0, 1], "cam_R_m2c has 4 numbers, not 9"),
    "t beyond sight": ("cam_t_m2c", [0, 0, 1e12], "cam_t_m2c is 1e+12 mm"),
    "id a way out": ("obj_id", "../../1", "obj_id contains '../../1'"),
}


@pytest.mark.parametrize("name", [*CAMERAS, *POSES])
def test_a_camera_or_an_annotation_that_cannot_be(damaged, name):
    key, value, words = CAMERAS.get(name) or POSES[name]
    path, where = (CAMERA, "") if name in CAMERAS else (TRUTH, "" if "NaN" in words else ": image 0, object 1:")
    edit(damaged.parent / path, lambda of: (of["0"] if name in CAMERAS else of["0"][1]).update({key: value}))
    refusal(instances(), damaged.parent, f"{path}{where}", words)


TRUTHS = {
    "a list": ("[]", "its top level is not an object"),
    "half": ('{"0": [{"obj_id": 1', "is not a scene's JSON file"),
    "no UTF-8": (b'{"\xff": []}', "is not a scene's JSON file ('utf-8' codec"),
    "an image twice": ('{"0": [], "0": []}', "key '0' appears twice"),
    "an image twice in other words": ('{"0": [], "00": []}', "image 0 occurs twice"),
    "a negative image": ('{"-1": []}', "its key '-1' is not an image number"),
    "a map of objects": ('{"0": {"1": 2}}', "image 0 has no list of objects"),
    "a word for an object": ('{"0": ["obj_id"]}', "image 0, object 0: has no cam_R_m2c"),
    "an image that is not there": ('{"7": []}', "has no image 7"),
}


@pytest.mark.parametrize("name", TRUTHS)
def test_a_file_of_poses_that_is_none(damaged, name):
    content, words = TRUTHS[name]
    (damaged.parent / TRUTH).write_bytes(content if isinstance(content, bytes) else content.encode())
    refusal(instances(), damaged.parent, str(SCENE), words)


def test_a_file_of_poses_too_large_to_be_one(damaged):
    with (damaged.parent / TRUTH).open("r+b") as file:
        file.truncate(2**33)
    refusal(instances(), damaged.parent, str(TRUTH), "is 8.59 GB, more than the limit of 67.1 MB")


INSTEAD = {
    "folder": (Path.mkdir, "is a folder"),
    "pipe": (os.mkfifo, "is a device, pipe"),
    "loop": (lambda path: path.symlink_to(path.name), "cannot be read"),
}


@pytest.mark.parametrize("kind", INSTEAD)
@pytest.mark.parametrize("name", ["scene_camera.json", "depth/000000.png", "mask_visib/000000_000000.png"])
def test_something_else_in_place_of_a_file(damaged, name, kind):
    make, found = INSTEAD[kind]
    (path := damaged.parent / SCENE / name).unlink()
    make(path)
    # An image may have any of several suffixes.
    refusal(instances(), damaged.parent, f"{SCENE / name}: {'no such' if name.endswith('.png') else found}")


def all_truths(change):
    return lambda folder: [edit(path, change) for path in folder.rglob("scene_gt.json")]


def twice(folder):
    (folder / "test_other").mkdir()
    (folder / "test/000001").rename(folder / "test_other/000000")


FOLDERS = {
    "scenes without images": (all_truths(lambda truth: truth.clear()), "lists no image"),
    "images without objects": (
        all_truths(lambda truth: truth.update({image: [] for image in truth})),
        "list no object in any frame",
    ),
    "a scene with a name": (
        lambda folder: (folder / "test/000001").rename(folder / "test/first"),
        "test/first: the name of a scene's folder is not a number",
    ),
    "a scene in two folders": (twice, "are the same image of the same scene; set split"),
    "no scenes": (lambda folder: (folder / "test").rename(folder / "train"), "has no test*/<scene>/scene_gt.json"),
    **FAULTS,
}


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_that_is_no_dataset(damaged, name):
    spoil, words = FOLDERS[name]
    spoil(damaged)
    refusal(instances(), damaged.parent, words, ";")


def test_what_a_real_dataset_may_have_is_no_fault(scenes, tmp_path):
    shutil.copytree(scenes, tmp_path / "tiny")
    expected, _ = read(scenes, tmp_path / "objects.npz")

    def change_cameras(cameras):
        for camera in cameras.values():
            camera["cam_K"] = [camera["cam_K"][row : row + 3] for row in (0, 3, 6)]
            camera["elev"] = "unknown keys"

    def change_poses(truth):
        for entries in truth.values():
            for entry in entries:
                entry["obj_id"] = float(entry["obj_id"])

    edit(tmp_path / CAMERA, change_cameras)
    edit(tmp_path / TRUTH, change_poses)
    (tmp_path / CAMERA).rename(tmp_path / "camera.json")
    (tmp_path / CAMERA).symlink_to(tmp_path / "camera.json")
    (tmp_path / SCENE / "scene_gt_info.json").write_text(json.dumps(None))
    found, _ = read(tmp_path / "tiny", tmp_path / "objects.npz")
    assert (found.points_m == expected.points_m).all()
