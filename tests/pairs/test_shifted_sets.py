import numpy as np

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


def test_every_set_is_trained_on_one_that_is_trained_on_itself():
    assert all(TRAINED_ON[home] == home for home in TRAINED_ON.values())


def test_rows_become_registrations_without_clouds_and_parts_are_joined_in_order():
    rows = sets().rows("severity", "test")
    registrations = sets().registrations(rows)
    assert len(registrations) == len(rows) == 12
    assert np.array_equal(registrations.embedding, sets().h[rows])
    assert len(registrations.cloud(3)) == 0
    assert set(registrations.subset(np.array([2, 5])).without_labels().concept) == {""}
    joined = ShiftedSets.joined([sets(), sets(3)])
    assert len(joined.set) == 6 * 12 + 6 * 3
    assert np.array_equal(joined.h[72:], sets(3).h)
