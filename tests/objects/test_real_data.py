"""The readers on the real objects, where a folder with them is at hand: GPCA_REAL_DATA names it."""

import os

import pytest

from gpca.objects.canonical import ObjectClouds, write_objects
from gpca.objects.source import resolve, surfaces

DATA_DIR = os.environ.get("GPCA_REAL_DATA")
pytestmark = pytest.mark.skipif(not DATA_DIR, reason="GPCA_REAL_DATA names no folder")
LINEMOD = [1, 2, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15]
SOURCES = {
    "ycb": ({"kind": "bop", "location": "bop/ycbv", "unit": "mm"}, 21, (0.08, 0.28)),
    "linemod": ({"kind": "bop", "location": "bop/lm", "unit": "mm", "objects": LINEMOD}, 13, (0.10, 0.30)),
    "coffee_cup": (
        {"kind": "mesh_folder", "unit": "m", "files": ["coffee_cup/*.ply", "ycb/065-*_cups.ply"]}, 11, (0.07, 0.13)
    ),
    "apple": ({"kind": "uw_rgbd", "files": ["coffee_cup/*.pcd"]}, 1, (0.10, 0.11)),
}  # fmt: skip


@pytest.mark.parametrize("name", SOURCES)
def test_real_objects(name, tmp_path):
    entry, count, (smallest_m, largest_m) = SOURCES[name]
    write_objects(surfaces(resolve(entry, DATA_DIR), tmp_path), name, tmp_path / "objects.npz", n_points=2048)
    clouds = ObjectClouds.load(tmp_path / "objects.npz")
    assert len(clouds) == count
    assert smallest_m < clouds.diameters_m.min() <= clouds.diameters_m.max() < largest_m


def test_every_instance_of_the_real_frames_lies_on_its_model(tmp_path):
    from pathlib import Path

    from gpca.frames.initial_pose import InitialPoseSettings
    from gpca.frames.plausibility import points_on_model
    from gpca.frames.reading import Dataset, read_instances, read_models

    read = {}
    for name in ("ycbv", "lm", "lmo"):
        dataset = Dataset(name, (Path(DATA_DIR, "bop", name),))
        frames = dataset.frames()
        read[name] = (dataset, frames, read_models(dataset, frames))
    written = (model.surface for _, _, models in read.values() for model in models.values())
    write_objects(written, "real_rgbd", tmp_path / "objects.npz", n_points=16384)
    objects = ObjectClouds.load(tmp_path / "objects.npz")
    instances = read_instances(read, objects, InitialPoseSettings("true_pose"))
    assert len(instances) == sum(len(frame.annotations) for _, frames, _ in read.values() for frame in frames)
    assert points_on_model(instances, objects).max() < 5e-3
