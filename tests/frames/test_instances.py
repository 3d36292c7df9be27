from dataclasses import fields

import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.frames.dataset import simplified
from gpca.frames.instances import Instances
from gpca.io.arrays import save_arrays
from gpca.objects.surface import Surface


def test_no_scene_is_in_training_and_test_and_one_number_in_two_datasets_is_two_scenes(tiny):
    instances, _ = tiny
    for seed in range(5):
        rows = instances.split("tiny", seed, test_share=0.4)
        assert sorted(np.concatenate([*rows.values()])) == list(range(len(instances)))
        assert not set(instances.scene[rows["train"]]) & set(instances.scene[rows["test"]])
        assert len(rows["train"]) and len(rows["test"])
    splits = {tuple(instances.split("tiny", seed, 0.4)["test"]) for seed in range(5)}
    assert len(splits) > 1
    dataset = np.where(np.arange(len(instances)) % 2 == 0, "one", "other")
    rows = changed_columns(instances, {"scene": np.zeros(len(instances), int), "dataset": dataset}).split("t", 0, 0.4)
    assert {tuple(np.unique(dataset[rows[split]])) for split in ("train", "test")} == {("one",), ("other",)}


def changed_columns(instances, changes):
    return Instances(**{field.name: getattr(instances, field.name) for field in fields(instances)} | changes)


@pytest.mark.parametrize("share", [0.01, 0.99])
def test_both_splits_have_frames_whatever_the_share(tiny, share):
    rows = tiny[0].split("tiny", 0, share)
    assert len(rows["train"]) and len(rows["test"])


def test_frames_of_one_scene_cannot_be_split(tiny):
    alike = changed_columns(tiny[0], {"scene": np.zeros(len(tiny[0]), int)})
    with pytest.raises(InputError, match="all are from one scene"):
        alike.split("tiny", 0, 0.4)


def test_instances_survive_their_file(tiny, tmp_path):
    instances, _ = tiny
    instances.save(tmp_path / "instances.npz", ("tiny", None))
    loaded = Instances.load(tmp_path / "instances.npz")
    for field in fields(Instances):
        assert np.array_equal(getattr(loaded, field.name), getattr(instances, field.name))


def save(tiny, path, **changes):
    arrays = {field.name: getattr(tiny[0], field.name) for field in fields(Instances) if field.name != "axes"}
    save_arrays(path, arrays | {name: change(arrays[name]) for name, change in changes.items()}, ("tiny", None))


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("offsets", lambda a: a[:-1], r"'offsets' is \d+, not \d+"),
        ("offsets", lambda a: a[::-1], "'offsets' do not match"),
        ("symmetric", lambda a: a.astype(str), "array 'symmetric' has type <U"),
    ],
)
def test_a_faulty_file_is_refused(tiny, tmp_path, name, change, expected):
    save(tiny, tmp_path / "instances.npz", **{name: change})
    with pytest.raises(InputError, match=expected):
        Instances.load(tmp_path / "instances.npz")


def test_a_scan_is_simplified_and_keeps_its_size_and_a_cloud_of_points_is_refused():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    simple = simplified(Surface("ball", ball.vertices, ball.faces), most_faces=200)
    assert len(simple.triangles) == 200
    assert np.linalg.norm(simple.vertices_m, axis=1) == pytest.approx(0.05, rel=0.05)
    assert simplified(Surface("ball", ball.vertices, ball.faces)).faces is ball.faces
    with pytest.raises(InputError, match="object 'cup': is a point cloud, but the virtual camera needs a mesh"):
        simplified(Surface("cup", np.zeros((70, 3)), None))
