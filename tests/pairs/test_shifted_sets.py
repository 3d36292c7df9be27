from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.pairs.shifted_sets import DISTANCES, TRAINED_ON, ShiftedSets


def sets(n=12):
    """Training and test samples of both encoders, and of two of their shifted sets."""
    names = np.repeat(["in_distribution", "in_distribution", "severity", "seen_objects", "seen_objects", "objects"], n)
    split = np.repeat(["train", "test", "test", "train", "test", "test"], n)
    random = np.random.default_rng(0)
    concept = np.tile(["noise", "pose", "overlap"], 2 * n)
    h = random.normal(size=(6 * n, 4)) + 3 * (concept == "pose")[:, None]
    distance = random.random((6 * n, len(DISTANCES)))
    cup = np.full(6 * n, "cup")
    return ShiftedSets(names, split, np.tile(np.arange(n), 6), concept, cup, cup, h, distance)


def test_a_file_gives_back_what_was_saved(tmp_path):
    sets().save(tmp_path / "seed0.npz", ("tiny", 0))
    loaded = ShiftedSets.load(tmp_path / "seed0.npz")
    for name, array in sets().arrays.items():
        assert np.array_equal(getattr(loaded, name), array)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"split": "valid"}, "the split 'valid', which is neither train nor test"),
        ({"h": np.nan}, "array 'h' contains NaN"),
    ],
)
def test_bad_files_are_one_line(tmp_path, change, message):
    [(name, value)] = change.items()
    array = getattr(sets(), name)
    replace(sets(), **{name: np.full(array.shape, value)}).save(tmp_path / "seed0.npz", ("tiny", 0))
    with pytest.raises(InputError, match=message):
        ShiftedSets.load(tmp_path / "seed0.npz")


def test_every_set_is_trained_on_one_that_is_trained_on_itself():
    assert all(TRAINED_ON[home] == home for home in TRAINED_ON.values())


def test_rows_become_registrations_without_clouds():
    rows = sets().rows("severity", "test")
    registrations = sets().registrations(rows)
    assert len(registrations) == len(rows) == 12
    assert np.array_equal(registrations.embedding, sets().h[rows])
    assert len(registrations.cloud(3)) == 0
    assert set(registrations.subset(np.array([2, 5])).without_labels().concept) == {""}


def test_parts_are_joined_in_order():
    joined = ShiftedSets.joined([sets(), sets(3)])
    assert len(joined.set) == 6 * 12 + 6 * 3
    assert np.array_equal(joined.h[72:], sets(3).h)
