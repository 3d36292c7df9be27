import json
import shutil

import numpy as np
import pytest
from PIL import Image

from gpca.errors import InputError
from gpca.frames.bop import (
    Annotation,
    Frame,
    TooFewPoints,
    back_project,
    measured_points,
    read_frames,
    without_background,
)
from gpca.frames.dataset import Dataset, read_models

from .tiny import read

SCENE = "test/000001"


def edit(path, change):
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def save(path, pixels):
    Image.fromarray(pixels).save(path)


def test_a_pixel_is_projected_back_by_hand():
    depth_m = np.zeros((4, 5), np.float32)
    depth_m[1, 3] = 2.0
    camera_3_3 = np.array([[10.0, 0, 2], [0, 20, 3], [0, 0, 1]])
    points, pixels = back_project(depth_m, np.ones((4, 5), bool), camera_3_3)
    assert points.tolist() == [[(3 - 2) / 10 * 2, (1 - 3) / 20 * 2, 2.0]]
    assert pixels.tolist() == [[3, 1]]


def test_what_lies_a_diameter_behind_the_object_is_not_of_it(tmp_path):
    save(tmp_path / "mask.png", np.full((20, 20), 255, np.uint8))
    frame = Frame(0, 0, np.array([[100.0, 0, 10], [0, 100, 10], [0, 0, 1]]), 1.0, None, None, ())
    depth_m = np.full((20, 20), 1.0, np.float32)
    depth_m[:, :3] = 1.5  # seen past its edge
    annotation = Annotation(1, np.eye(4), tmp_path / "mask.png", "scene_gt.json")
    points, _ = without_background(*measured_points(frame, annotation, depth_m), annotation, diameter_m=0.3)
    assert len(points) == 20 * 17
    assert points[:, 2].max() == 1.0


def test_frames_are_found_in_any_archive_of_the_dataset_and_may_be_a_draw(scenes, tmp_path):
    assert len(read_frames([tmp_path, scenes])) == 6
    few = Dataset("tiny", (scenes,), most_frames=3).frames()
    assert [(frame.scene, frame.image) for frame in few] == [
        (frame.scene, frame.image) for frame in Dataset("tiny", (scenes,), most_frames=3).frames()
    ]
    assert len(few) == 3


def test_colour_may_be_jpeg(damaged):
    for path in (damaged / SCENE / "rgb").iterdir():
        Image.open(path).save(path.with_suffix(".jpg"))
        path.unlink()
    assert {frame.color.suffix for frame in read_frames([damaged])} == {".png", ".jpg"}


def test_an_object_of_which_little_was_measured_is_left_out_and_named(tiny, damaged, tmp_path, capsys):
    mask = damaged / SCENE / "mask_visib/000000_000001.png"
    pixels = np.zeros((120, 160), np.uint8)
    pixels[60, 40:70] = 255
    save(mask, pixels)
    instances, _ = read(damaged, tmp_path / "objects.npz")
    assert f"skipped: {mask}: has depth at" in (told := capsys.readouterr().err)
    assert "64 are needed" in told
    assert len(instances) == len(tiny[0]) - 1
    frame = next(frame for frame in read_frames([damaged]) if (frame.scene, frame.image) == (1, 0))
    with pytest.raises(TooFewPoints, match="000000_000001"):
        measured_points(frame, frame.annotations[1], frame.depth_m())


FAULTS = {
    "no depth": (lambda f: (f / SCENE / "depth/000001.png").unlink(), "depth/000001.png: no such image"),
    "no mask": (lambda f: (f / SCENE / "mask_visib/000000_000002.png").unlink(), "000000_000002.png: no such image"),
    "no camera": (lambda f: (f / SCENE / "scene_camera.json").unlink(), "scene_camera.json: no such file"),
    "half unpacked": (lambda f: [p.unlink() for p in (f / SCENE / "depth").iterdir()], "may be half unpacked"),
    "no scene": (lambda f: [p.unlink() for p in f.rglob("scene_gt.json")], "has no test"),
    "broken JSON": (lambda f: (f / SCENE / "scene_gt.json").write_text("{"), "scene_gt.json: is not a scene's JSON"),
    "camera of another image": (
        lambda f: edit(f / SCENE / "scene_camera.json", lambda c: c.pop("1")),
        "scene_camera.json: has no image 1",
    ),
    "camera without K": (
        lambda f: edit(f / SCENE / "scene_camera.json", lambda c: c["1"].pop("cam_K")),
        "scene_camera.json: image 1: has no cam_K",
    ),
    "depth of another size": (
        lambda f: save(f / SCENE / "depth/000000.png", np.full((60, 80), 7000, np.uint16)),
        "000000_000000.png: is 160×120 but depth is 80×60",
    ),
    "no measurement": (
        lambda f: save(f / SCENE / "depth/000000.png", np.zeros((120, 160), np.uint16)),
        "depth/000000.png: has no depth: every pixel is 0",
    ),
    "colour for depth": (
        lambda f: save(f / SCENE / "depth/000000.png", np.ones((120, 160, 3), np.uint8)),
        "is a color image, not depth",
    ),
    "truncated depth": (
        lambda f: (f / SCENE / "depth/000000.png").write_bytes((f / SCENE / "depth/000000.png").read_bytes()[:999]),
        "depth/000000.png: is truncated",
    ),
    "unknown object": (
        lambda f: edit(f / SCENE / "scene_gt.json", lambda g: g["0"][0].update(obj_id=77)),
        "tiny: object 77: has no model in",
    ),
    "no rotation": (
        lambda f: edit(f / SCENE / "scene_gt.json", lambda g: g["0"][1].update(cam_R_m2c=[1, 0, 0, 0, 1, 0, 0, 0, -1])),
        "scene_gt.json: image 0, object 1: the pose is not a rigid transform",
    ),
    "eight numbers": (
        lambda f: edit(f / SCENE / "scene_gt.json", lambda g: g["0"][1].update(cam_R_m2c=[1, 0, 0, 0, 1, 0, 0, 0])),
        "image 0, object 1: cam_R_m2c has 8 numbers, not 9",
    ),
    "no models": (lambda f: [p.unlink() for p in (f / "models").glob("*.ply")], "has no models/obj_"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_dataset_is_refused_in_one_line(damaged, tmp_path, fault):
    spoil, expected = FAULTS[fault]
    spoil(damaged)
    with pytest.raises(InputError) as caught:
        read(damaged, tmp_path / "objects.npz")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)
    assert ";" in str(caught.value)  # what to do


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
