"""The steps from datasets to registrations, and what they say of faulty datasets."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import trimesh

from gpca.frames.dataset import Dataset
from gpca.frames.instances import Instances
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from tests.steps.by_words import main

REGISTRATIONS = {"train": 9, "test": 6, "cloud_points": 128, "test_share": 0.4, "occluders": 1.0}


def drawn(folder, *words, **given):
    """The status of the step ``scenes``, which draws two small ones into the folder."""
    camera = {"width": 64, "height": 48, "focal_px": 60}
    settings = json.dumps({"count": 2, "views": 1, "objects": [2, 2], "camera": camera} | given)
    return main(["scenes", "--source", "virtual", "--settings", settings, "--out", str(folder / "drawn"), *words])


def listed(folder):
    return json.loads((folder / "models/models_info.json").read_text())


@pytest.fixture
def read(scenes, tmp_path):
    def run(*more, given=None):
        given = given or {"initial_pose": {"form": "true_pose"}, "datasets": {"tiny": {"location": str(scenes)}}}
        files = ["--instances", str(tmp_path / "instances.npz"), "--objects", str(tmp_path / "objects.npz")]
        names = ["--source", "tiny", "--surface-points", "1024"]
        return main(["instances", *names, "--settings", json.dumps(given), *files, *more]), tmp_path

    return run


def test_a_dataset_becomes_registrations(read):
    status, folder = read()
    assert status == 0
    instances, objects = Instances.load(folder / "instances.npz"), ObjectClouds.load(folder / "objects.npz")
    assert set(objects.names) == {"tiny brick", "tiny cylinder", "tiny cone", "tiny capsule", "tiny bracket"}
    assert set(instances.object_index) == set(range(5))
    sources = ("--instances", str(folder / "instances.npz"), "--objects", str(folder / "objects.npz"))
    outputs = [str(folder / name) for name in ("seed0.npz", "poses.csv", "timings.csv")]
    step = ["frame_registrations", *sources, "--source", "tiny", "--seed", "0", "--settings", json.dumps(REGISTRATIONS)]
    assert main([*step, "--registrations", outputs[0], "--poses", outputs[1], "--timings", outputs[2]]) == 0
    registrations, poses = Registrations.load(outputs[0]), pd.read_csv(outputs[1])
    assert (poses["sample"].to_numpy() == registrations.sample).all()
    assert np.isfinite(poses[["init_error", "icp_error"]]).all(axis=None)
    assert (folder / "poses.csv.provenance.json").is_file()


def test_scenes_are_drawn_by_a_command(tmp_path, monkeypatch):
    from gpca.objects import procedural

    from .tiny import surfaces

    monkeypatch.setattr(procedural, "surfaces", lambda family: iter(surfaces()))
    assert drawn(tmp_path, families=["ycb"]) == 0
    assert len(list((tmp_path / "drawn/test/000000/mask_visib").iterdir())) == 2


def test_scenes_are_drawn_of_the_models_of_datasets(scenes, tmp_path):
    """Encoders can be pretrained on them: every object that a frame shows, in the frame and the size that it has."""
    datasets = {name: {"location": str(scenes)} for name in ("tiny", "twin")}
    assert drawn(tmp_path, datasets=datasets) == 0
    made, shown = (listed(folder) for folder in (tmp_path / "drawn", scenes))
    assert len(made) == len(shown)  # those of the twin are the same
    diameters_mm = [[model["diameter"] for model in models.values()] for models in (made, shown)]
    assert diameters_mm[0] == pytest.approx(diameters_mm[1], rel=0.01)


def test_objects_that_are_tested_are_rendered_only_if_that_is_asked(scenes, tmp_path, capsys):
    shutil.copytree(scenes, tmp_path / "set")
    dataset = Dataset("set", (tmp_path / "set",), most_frames=None)
    tested = min(frame.scene for frame in dataset.frames())
    for path in (tmp_path / "set/test").glob("*/scene_gt.json"):  # of the tested scene, all but one annotation goes
        if int(path.parent.name) == tested:
            path.write_text(json.dumps({image: of[:1] for image, of in json.loads(path.read_text()).items()}))
    ids = {annotation.object_id for f in dataset.frames() if f.scene == tested for annotation in f.annotations}
    splits = tmp_path / "scenes.csv"
    roles = {frame.scene: "evaluation" if frame.scene == tested else "development" for frame in dataset.frames()}
    splits.write_text("dataset,scene,role,fold\n" + "".join(f"set,{n},{role},0\n" for n, role in roles.items()))
    of_set = {"datasets": {"set": {"location": str(tmp_path / "set")}}, "rendered": "training"}
    assert drawn(tmp_path, "--splits", str(splits), **of_set) == 0
    untested_mm = [model["diameter"] for number, model in listed(scenes).items() if int(number) not in ids]
    drawn_mm = sorted(model["diameter"] for model in listed(tmp_path / "drawn").values())
    assert drawn_mm == pytest.approx(sorted(untested_mm), rel=0.01)
    shutil.rmtree(tmp_path / "drawn")
    assert drawn(tmp_path, **of_set) == 2  # without splits every scene may be tested
    assert "no model of an object that is not tested can be rendered on a table" in capsys.readouterr().err


def test_models_that_cannot_stand_on_a_table_are_skipped(scenes, tmp_path, capsys):
    shutil.copytree(scenes, tmp_path / "set")
    cloud, sheet, *_ = sorted((tmp_path / "set/models").glob("*.ply"))
    trimesh.PointCloud(trimesh.load(cloud).sample(2000)).export(cloud)
    flat = trimesh.load(sheet)
    flat.vertices[:, 2] = 0
    flat.export(sheet)
    described = tmp_path / "set/models/models_info.json"
    told = json.loads(described.read_text())
    told["2"]["diameter"] = 80.0  # of the cylinder's base
    described.write_text(json.dumps(told))
    datasets = {"tiny": {"location": str(tmp_path / "set")}}
    assert drawn(tmp_path, datasets=datasets) == 0
    told = capsys.readouterr().err
    assert "is a point cloud, but the virtual camera needs a mesh" in told
    assert "is flat and cannot be stood on a table" in told
    made, shown = (listed(folder) for folder in (tmp_path / "drawn", scenes))
    assert len(made) == len(shown) - 2


def test_datasets_without_any_model_that_can_stand_are_refused(scenes, tmp_path, capsys):
    shutil.copytree(scenes, tmp_path / "set")
    for path in (tmp_path / "set/models").glob("*.ply"):
        trimesh.PointCloud(trimesh.load(path).sample(2000)).export(path)
    assert drawn(tmp_path, datasets={"tiny": {"location": str(tmp_path / "set")}}) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert told.startswith("gpca scenes: real_world.datasets: no model of them can be rendered on a table; set real_")
    assert not (tmp_path / "drawn").exists()


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"datasets": {"tiny": {"location": "/nowhere/at/all"}}}, "/nowhere/at/all does not exist"),
        ({"datasets": {"tiny": {"location": "/usr", "results": "/lost.csv"}}}, "/lost.csv: no such results file; "),
    ],
)
def test_a_faulty_call_ends_in_one_line(read, capsys, given, expected):
    status, folder = read(given=given)
    assert status == 2
    error = capsys.readouterr().err
    assert expected in error
    assert error.count("\n") == 1
    assert not (folder / "instances.npz").exists()


def test_no_dataset_and_no_scenes_are_nothing_to_read(read, capsys):
    status, _ = read(given={"initial_pose": {"form": "true_pose"}})
    assert status == 2
    assert "name a dataset, or the folder of the step scenes" in capsys.readouterr().err
