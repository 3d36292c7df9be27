"""The data of the repository: whole, with its licenses and splits, and readable by what reads it."""

import hashlib
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import yaml

from gpca.errors import InputError
from gpca.frames import instances as reading
from gpca.frames.dataset import Dataset, read_models
from gpca.frames.initial_pose import InitialPoseSettings, read_bop_results
from gpca.frames.instances import FARTHEST, read_instances
from gpca.io.csv_file import read_csv
from gpca.objects import canonical
from gpca.objects.bop import read_models_info
from gpca.objects.source import DATA, VERSION, require_whole, resolve, surfaces

PARTS = ("ycb", "ycbv", "lm", "lmo", "estimates")
LARGEST_BYTES = 40e6
OBJECTS, SCENES = DATA / "splits/objects.csv", DATA / "splits/scenes.csv"
INSTANCES = {"ycbv": 87, "lm": 59, "lmo": 8}


def listed():
    """The checksum of every file that SHA256SUMS lists."""
    lines = (DATA / "SHA256SUMS").read_text().splitlines()
    return {name: sha256 for sha256, name in (line.split("  ") for line in lines)}


def entries():
    """The sources of the default and of the development config."""
    texts = (DATA.parent / "config" / name for name in ("sources.yaml", "development.yaml"))
    sources = [yaml.safe_load(text.read_text())["sources"] for text in texts]
    return {name: entry for part in sources for name, entry in part.items() if entry}


def test_every_file_is_listed_with_its_checksum():
    paths = [path for path in DATA.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    beside = {"SHA256SUMS", "make_data.py"}
    assert {path.relative_to(DATA).as_posix() for path in paths} - beside == set(listed())
    assert all(hashlib.sha256((DATA / name).read_bytes()).hexdigest() == sha256 for name, sha256 in listed().items())
    assert sum(path.stat().st_size for path in paths) < LARGEST_BYTES


@pytest.mark.parametrize("part", PARTS)
def test_every_part_has_its_license_beside_it(part):
    text = (DATA / part / "LICENSE.md").read_text()
    assert re.search("CC BY(-SA)? 4.0|MIT License", text)
    assert "http" in text
    assert "Changed here: " in text
    if "MIT License" in text:  # which wants both notices in every copy
        assert "Copyright (c)" in text
        assert "shall be included in all copies" in text
    assert f"({part}/LICENSE.md)" in (DATA / "README.md").read_text()


def test_a_family_has_one_role_and_one_fold_in_all_sources():
    rows = read_csv(OBJECTS, ("source", "object", "name", "family", "role", "fold"))
    used = rows[rows["role"] != "unused"]
    assert (used.groupby("family")[["role", "fold"]].nunique() == 1).all(axis=None)
    unused = rows[rows["role"] == "unused"]
    assert len(unused) == 2
    assert all((DATA / "ycb" / f"{name}.ply").is_file() for name in unused["object"])
    assert set(unused["family"]) <= set(used.loc[used["role"] == "evaluation", "family"])  # the reason why they are


@pytest.mark.parametrize("config", ["sources.yaml", "development.yaml"])
def test_a_folder_with_other_data_hides_none_of_ours(config, tmp_path):
    sources = yaml.safe_load((DATA.parent / "config" / config).read_text())["sources"]
    for entry in filter(None, sources.values()):
        assert resolve(entry, str(tmp_path)) == resolve(entry, None)


@pytest.mark.parametrize(
    ("name", "count", "smallest_m", "largest_m"),
    [("ycb", 21, 0.08, 0.28), ("linemod", 13, 0.10, 0.30), ("coffee_cup", 10, 0.07, 0.13),
     ("ycb_development", 34, 0.02, 0.45)],
)  # fmt: skip
def test_every_source_is_read_with_its_families(name, count, smallest_m, largest_m, tmp_path):
    entry = resolve(entries()[name], None)
    canonical.write_objects(surfaces(entry, tmp_path), name, tmp_path / "objects.npz", 512, OBJECTS)
    clouds = canonical.ObjectClouds.load(tmp_path / "objects.npz", name)
    places = canonical.read_object_splits(OBJECTS, name)
    assert len(clouds) == count
    assert smallest_m < clouds.diameters_m.min() <= clouds.diameters_m.max() < largest_m
    assert [(clouds.families[i], clouds.folds[i]) for i in range(count)] == [
        (places[object_name].cluster, places[object_name].fold) for object_name in clouds.names
    ]
    assert set(clouds.names) == {object_name for object_name, place in places.items() if place.role != "unused"}


def dataset(name, **changes):
    models = {"models": DATA / "lm"} if name == "lmo" else {}
    return Dataset(name, (DATA / name,), places=canonical.read_scene_splits(SCENES, name), **models, **changes)


@pytest.mark.parametrize("name", INSTANCES)
def test_every_frame_is_read_and_every_instance_lies_on_its_model(name, monkeypatch):
    near = []
    monkeypatch.setattr(
        reading, "require_near", lambda _, distance_m, diameter_m: near.append((distance_m, diameter_m))
    )
    of = dataset(name)
    frames = of.frames()
    models = read_models(of, frames)
    objects = canonical.sample_objects((model.surface for model in models.values()), name)
    instances = read_instances({name: (of, frames, models)}, objects, InitialPoseSettings("true_pose"))
    assert len(instances) == INSTANCES[name]
    distances_m, diameters_m = np.transpose(near)
    assert distances_m.max() < 5e-3
    assert (distances_m / diameters_m).max() < FARTHEST / 5
    shown = {frame.scene for frame in frames if frame.color}
    tested = {scene for scene, place in canonical.read_scene_splits(SCENES, name).items() if place.role == "evaluation"}
    assert shown == tested


def test_development_reads_other_scenes_than_are_tested():
    chosen_by = {frame.scene for frame in dataset("ycbv", role="development").frames()}
    folds = {scene: dataset("ycbv").fold(scene) for scene in canonical.read_scene_splits(SCENES, "ycbv")}
    assert chosen_by == {scene for scene, fold in folds.items() if fold == canonical.TRAINING} == {0, 1, 2}
    assert {fold for fold in folds.values() if fold != canonical.TRAINING} == {0, 1}


def test_a_scene_of_a_dataset_that_the_splits_lack_is_named():
    of = Dataset("lm", (DATA / "lm",), places=canonical.read_scene_splits(SCENES, "lmo"))
    with pytest.raises(InputError, match=r"dataset lm: scene 6 is in no split; .*splits\.scenes: null"):
        of.frames()


def test_every_results_file_is_read():
    poses = defaultdict(int)
    for path in sorted((DATA / "estimates").glob("*.csv")):
        name = path.name.split("_")[0]
        if path.stem.endswith("keyframe_errors"):  # errors, not poses
            continue
        distances_m = {f.place: [abs(a.T_camera_model[2, 3]) for a in f.annotations] for f in dataset(name).frames()}
        known = read_models_info(dataset(name).models_folder() / "models_info.json")
        poses[name] += sum(map(len, read_bop_results(path, distances_m, known).values()))
    assert poses == {"ycbv": 133, "lmo": 14}


@pytest.fixture
def folder(tmp_path):
    """A folder of data with one file."""
    (tmp_path / "part").mkdir()
    (tmp_path / "part/mesh.ply").write_bytes(b"ply")
    (tmp_path / "VERSION").write_text(f"{VERSION}\n")
    names = ("VERSION", "part/mesh.ply")
    sums = [f"{hashlib.sha256((tmp_path / name).read_bytes()).hexdigest()}  {name}\n" for name in names]
    (tmp_path / "SHA256SUMS").write_text("".join(sums))
    return tmp_path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: (f / "part/mesh.ply").write_bytes(b"plz"), "part/mesh.ply: is not the file that SHA256SUMS lists; "),
        (lambda f: (f / "part/mesh.ply").unlink(), "part/mesh.ply: no such file; restore it: git checkout -- data"),
        (lambda f: (f / "SHA256SUMS").unlink(), "SHA256SUMS: no such file; restore it"),
        (
            lambda f: (f / "VERSION").write_text("0\n"),
            f"is version 0 of the data, and this code reads version {VERSION}",
        ),
        (lambda f: (f / "VERSION").unlink(), "is version unknown of the data"),
    ],
)
def test_data_that_is_not_as_published_is_refused(folder: Path, change, message):
    change(folder)
    with pytest.raises(InputError) as caught:
        require_whole(folder)
    assert message in str(caught.value)
    assert "git checkout -- data" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_data_as_published_passes(folder):
    require_whole(folder)


HEAD = "source,object,name,family,role,fold\n"
FAULTS = {
    "twice": ("ycb,a,a,box,evaluation,0\nycb,a,a,box,evaluation,0\n", "'a' occurs twice"),
    "role": ("ycb,a,a,box,test,0\n", "'a' has the role 'test'; choose one of development, evaluation, unused"),
    "fold": ("ycb,a,a,box,evaluation,first\n", "'a' has the fold 'first'; number the folds from 0"),
    "two folds": ("ycb,a,a,box,evaluation,0\nycb,b,b,box,evaluation,1\n", "'box' has two roles or is in two folds"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faulty_splits_are_refused_in_one_line(tmp_path, name):
    rows, message = FAULTS[name]
    path = tmp_path / "objects.csv"
    path.write_text(HEAD + rows)
    with pytest.raises(InputError) as caught:
        canonical.read_object_splits(path, "ycb")
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_an_object_that_the_splits_lack_is_named(tmp_path):
    (tmp_path / "objects.csv").write_text(HEAD + "ycb,a,a,box,evaluation,0\n")
    entry = resolve(entries()["ycb"], None)
    with pytest.raises(InputError, match=r"object 'obj_000001': is in no split; .*splits\.objects: null"):
        canonical.write_objects(
            surfaces(entry, tmp_path), "ycb", tmp_path / "objects.npz", 512, tmp_path / "objects.csv"
        )
