from dataclasses import fields

import numpy as np
import pytest

from gpca.arrays import save_arrays
from gpca.errors import InputError
from gpca.frames.instances import Instances, groups_of_frames


def test_images_that_follow_each_other_are_one_group_and_scenes_never_are():
    scene = np.array([1, 0, 0, 0, 0, 1])
    image = np.array([3, 0, 20, 9, 31, 2])
    groups = groups_of_frames(scene, image, gap=10)
    assert groups[1] == groups[3]  # 0 and 9
    assert groups[2] != groups[3]  # 9 and 20
    assert groups[4] != groups[2]  # 20 and 31
    assert groups[0] == groups[5]
    assert len(set(groups)) == 4


def test_no_group_is_in_training_and_test(tiny):
    instances, _ = tiny
    for seed in range(5):
        rows = instances.split("tiny", seed, test_share=0.4)
        assert sorted(np.concatenate([*rows.values()])) == list(range(len(instances)))
        assert not set(instances.group[rows["train"]]) & set(instances.group[rows["test"]])
        assert len(rows["train"]) and len(rows["test"])
    splits = {tuple(instances.split("tiny", seed, 0.4)["test"]) for seed in range(5)}
    assert len(splits) > 1


@pytest.mark.parametrize("share", [0.01, 0.99])
def test_both_splits_have_frames_whatever_the_share(tiny, share):
    rows = tiny[0].split("tiny", 0, share)
    assert len(rows["train"]) and len(rows["test"])


def test_frames_of_one_group_cannot_be_split(tiny):
    instances, _ = tiny
    columns = {field.name: getattr(instances, field.name) for field in fields(instances)}
    alike = Instances(**columns | {"group": np.zeros(len(instances), int)})
    with pytest.raises(InputError, match="all are of one group of frames"):
        alike.split("tiny", 0, 0.4)


def test_instances_survive_their_file(tiny, tmp_path):
    instances, _ = tiny
    instances.save(tmp_path / "instances.npz")
    loaded = Instances.load(tmp_path / "instances.npz")
    for field in fields(Instances):
        assert np.array_equal(getattr(loaded, field.name), getattr(instances, field.name))


@pytest.mark.parametrize(
    ("spoilt", "expected"),
    [
        ({"offsets": lambda a: a[:-1]}, "'offsets' do not match"),
        ({"points_m": lambda a: np.full_like(a, np.nan)}, "'points_m' holds NaN"),
        ({"T_camera_object_init": lambda a: a[:, :3]}, "'T_camera_object_init' is"),
        ({"colour": None}, "'colour' is missing"),
    ],
)
def test_a_faulty_file_is_refused(tiny, tmp_path, spoilt, expected):
    arrays = {field.name: getattr(tiny[0], field.name) for field in fields(Instances)}
    for name, change in spoilt.items():
        if change is None:
            del arrays[name]
        else:
            arrays[name] = change(arrays[name])
    save_arrays(tmp_path / "instances.npz", arrays)
    with pytest.raises(InputError, match=expected):
        Instances.load(tmp_path / "instances.npz")
