"""Depth images and masks that are none, and depth that does not lie where the pose says."""

import shutil

import numpy as np
import pytest
from PIL import Image

from gpca.frames.bop import read_frames

from ..hostile import refusal
from ..steps.by_words import main
from .damage import DEPTH, MASK, SCENE, TRUTH, edit, instances, save

SHAPE = (120, 160)
FLAT = np.full(SHAPE, 7000, np.uint16)
COLOURS = np.random.default_rng(0).integers(1, 255, (*SHAPE, 3), np.uint8)


def as_tiff(pixels):
    """Write a TIFF, which holds what a PNG cannot, in place of the depth image."""

    def write(path):
        save(path.with_suffix(".tif"), pixels)
        path.unlink()

    return write


def halves(path):
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def bomb(side, mode="I;16"):
    return lambda path: Image.new(mode, (side, side)).save(path, compress_level=1)


IMAGES = {
    "depth of 8 bits": (DEPTH, lambda p: save(p, (FLAT / 30).astype(np.uint8)), "is color or 8-bit, not 16-bit depth"),
    "depth of colours": (DEPTH, lambda p: save(p, COLOURS), "is color or 8-bit, not 16-bit depth"),
    "no depth anywhere": (DEPTH, lambda p: save(p, 0 * FLAT), "has no depth: every pixel is 0"),
    "NaN depth": (DEPTH, as_tiff(np.full(SHAPE, np.nan, np.float32)), "has no depth: every pixel is 0"),
    "negative depth": (DEPTH, as_tiff(np.full(SHAPE, -0.7, np.float32)), "contains negative or infinite depth"),
    "depth cut": (DEPTH, halves, "is truncated or not a readable image"),
    "depth a bomb": (DEPTH, bomb(8500), "too many for a frame"),
    "depth turned": (DEPTH, lambda p: save(p, FLAT.T), "is 160×120 but depth is 120×160"),
    "mask small": (MASK, lambda p: save(p, np.full((60, 80), 255, np.uint8)), "is 80×60 but depth is 160×120"),
    "mask a bomb": (MASK, bomb(13_500, "L"), "too many for a frame"),
    "mask a picture": (MASK, lambda p: save(p, COLOURS), "is not a mask: most of its pixel values differ"),
    "mask everywhere": (MASK, lambda p: save(p, np.full(SHAPE, 255, np.uint8)), "lie", "masks"),
}  # fmt: skip


@pytest.mark.parametrize("name", IMAGES)
def test_an_image_that_is_none(damaged, name):
    path, spoil, *words = IMAGES[name]
    spoil(damaged.parent / path)
    named = path.name if "turned" not in name and "everywhere" not in name else SCENE.name
    refusal(instances(), damaged.parent, *([] if "depth" in name else [named]), *words, ";")


def test_a_dataset_whose_masks_are_all_empty(damaged):
    for path in damaged.rglob("mask_visib/*.png"):
        save(path, np.zeros(SHAPE, np.uint8))
    refusal(
        instances(), damaged.parent, "no object is left in any frame; the first skipped:", "has depth at 0 pixel(s)"
    )


def of_one(change):
    """Change the pose of one object in one image."""
    return lambda folder: edit(folder / TRUTH, lambda truth: change(truth["0"][1]))


def every(name, change):
    """Change the pose of every object, or every camera."""

    def spoil(folder):
        for path in folder.rglob(f"scene_{name}.json"):
            edit(
                path, lambda of: [change(entry) for each in of.values() for entry in (each if name == "gt" else [each])]
            )

    return spoil


def scaled(factor):
    return lambda entry: entry.update(cam_t_m2c=[factor * value for value in entry["cam_t_m2c"]])


def to_opengl(entry):
    flip = np.diag([1.0, -1, -1])
    entry["cam_R_m2c"] = (flip @ np.reshape(entry["cam_R_m2c"], (3, 3))).ravel().tolist()
    entry["cam_t_m2c"] = (flip @ entry["cam_t_m2c"]).tolist()


def beside(entry):
    entry["cam_t_m2c"][0] += 30


def outside(camera):
    camera["cam_K"][2] = 1000.0


PLACES = {
    "t in metres": (every("gt", scaled(1e-3)), "half of its measured points lie"),
    "one t of zeros": (of_one(scaled(0)), "check cam_R_m2c and cam_t_m2c (from model to camera, row by row"),
    "OpenGL": (every("gt", to_opengl), "y down and z forward"),
    "centre outside": (every("camera", outside), "cam_K"),
    "30 mm beside": (every("gt", beside), "above the limit of 3 % or 4 mm, whichever is more; check cam_R_m2c"),
}


@pytest.mark.parametrize("name", PLACES)
def test_depth_that_lies_elsewhere_than_the_pose(damaged, name):
    spoil, words = PLACES[name]
    spoil(damaged.parent)
    refusal(instances(), damaged.parent, "scene_gt.json: image ", ", object ", "diameter", words)


def test_the_dataset_itself_is_none_of_this(scenes, tmp_path):
    shutil.copytree(scenes, tmp_path / "tiny")
    arguments = instances(scenes=str(tmp_path / "tiny"))
    outputs = {"instances.npz": tmp_path / "instances.npz", "objects.npz": tmp_path / "objects.npz"}
    assert main([str(outputs.get(argument, argument)) for argument in arguments]) == 0
    assert all(path.is_file() for path in outputs.values())


def test_float_depth_without_measurements_is_read(damaged, tmp_path):
    path = damaged.parent / DEPTH
    expected = np.asarray(Image.open(path))
    save(path.with_suffix(".tif"), np.where(expected == 0, np.nan, expected).astype(np.float32))
    path.unlink()
    frame = next(frame for frame in read_frames([damaged]) if frame.depth.suffix == ".tif")
    assert (np.nan_to_num(frame.depth_m()) == expected * np.float32(frame.depth_scale / 1000)).all()


def test_a_mask_with_a_soft_rim_is_a_mask(damaged):
    path = damaged.parent / MASK
    mask = Image.open(path)
    mask.resize((40, 30), Image.Resampling.BILINEAR).resize(mask.size, Image.Resampling.BILINEAR).save(path)
    frame = next(frame for frame in read_frames([damaged]) if frame.depth == damaged.parent / DEPTH)
    assert frame.mask(frame.annotations[1]).any()
