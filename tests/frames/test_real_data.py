"""The reader on real frames, where a folder with them is at hand: GPCA_REAL_DATA names it."""

import os
from pathlib import Path

import pytest

from gpca.frames.estimates import read_bop_results
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.plausibility import FARTHEST, points_on_model
from gpca.frames.reading import Dataset, read_instances, read_models
from gpca.objects.bop import read_models_info
from gpca.objects.canonical import sample_objects

DATA_DIR = os.environ.get("GPCA_REAL_DATA")
pytestmark = pytest.mark.skipif(not DATA_DIR, reason="GPCA_REAL_DATA names no folder")
INSTANCES = {"ycbv": 87, "lm": 59, "lmo": 8, "icbin": 37, "visp": 32}


@pytest.mark.parametrize("name", INSTANCES)
def test_no_real_frame_is_refused(name):
    dataset = Dataset(name, (Path(DATA_DIR, "bop", name),))
    frames = dataset.frames()
    models = read_models(dataset, frames)
    objects = sample_objects((model.surface for model in models.values()), name)
    instances = read_instances({name: (dataset, frames, models)}, objects, InitialPoseSettings("true_pose"))
    assert len(instances) == INSTANCES[name]
    distances = points_on_model(instances, objects) / objects.diameters_m[instances.object_index]
    assert distances.max() < FARTHEST / 5


def test_no_real_results_file_is_refused():
    folder = Path(DATA_DIR, "bop")
    read = 0
    for path in sorted((folder / "estimates").glob("*.csv")):
        name = path.name.split("_")[0]
        if path.stem.endswith("keyframe_errors"):  # errors, not poses
            continue
        frames = Dataset(name, (folder / name,)).frames()
        distances_m = {f.place: [abs(a.T_camera_model[2, 3]) for a in f.annotations] for f in frames}
        known = read_models_info(folder / name / "models/models_info.json")
        read += sum(map(len, read_bop_results(path, distances_m, known).values()))
    assert read == 194
