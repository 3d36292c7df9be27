from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from gpca.alignment.rigid import rotation_angle_rad
from gpca.causes.candidate import draw_applied, draw_candidate, redrawn
from gpca.causes.settings import CauseSettings, CauseSeverities, Small

SETTINGS = CauseSettings(severities=CauseSeverities(outliers=(0.1, 0.2)))


@pytest.fixture(scope="module")
def candidates(subjects):
    return [
        draw_candidate(subjects[k % 4].surface, np.ones(3, bool), SETTINGS, np.random.default_rng(k)) for k in range(40)
    ]


def test_counts_and_severities_are_within_their_ranges(candidates):
    for candidate in candidates:
        severity = candidate.severity
        for count in (len(candidate.model), len(candidate.kept)):
            assert 128 <= count <= 1024
        assert 0.01 <= severity["noise"] <= 0.08
        assert 0.1 <= severity["outliers"] <= 0.2
        assert rotation_angle_rad(candidate.T_init) == pytest.approx(severity["rotation_rad"], abs=1e-6)
        assert np.deg2rad(10) <= severity["rotation_rad"] <= np.deg2rad(90)
        assert np.linalg.norm(candidate.T_init[:3, 3]) == pytest.approx(severity["translation"])
        assert len(candidate.kept) == round(len(candidate.clean) * (1 - severity["crop"]))
    assert len({len(candidate.model) - len(candidate.kept) for candidate in candidates}) > 30  # drawn apart


def test_the_number_of_observed_points_tells_nothing_of_what_is_missing(subjects):
    drawn = [
        draw_candidate(subjects[0].surface, np.array([False, False, hidden]), SETTINGS, np.random.default_rng(k))
        for k in range(20)
        for hidden in (False, True)
    ]
    counts = [len(candidate.observed(tuple(np.flatnonzero(candidate.applied)))) for candidate in drawn]
    assert np.abs(np.subtract(counts[::2], counts[1::2])).max() <= 1  # the share is rounded twice
    assert all(128 <= count <= 1024 for count in counts)


def test_what_is_not_applied_is_small_but_there(candidates):
    for candidate in candidates:
        assert 0 < rotation_angle_rad(candidate.T_near) <= np.deg2rad(5)
        assert 0 < np.linalg.norm(candidate.T_near[:3, 3]) <= 0.03
        assert 0.95 <= len(candidate.seen) / len(candidate.clean) <= 1
        assert set(candidate.kept) < set(candidate.seen)  # the same side is missing
        assert np.array_equal(candidate.start((0, 2)), candidate.T_near)
        assert np.array_equal(candidate.start((1,)), candidate.T_init)


def test_a_clean_surface_is_nearly_where_it_is(subjects):
    surface = subjects[0].surface
    candidate = draw_candidate(surface, np.zeros(3, bool), SETTINGS, np.random.default_rng(3))
    off = KDTree(surface).query(candidate.clean)[0]
    assert 0 < off.max() < 5 * 0.003
    assert candidate.severity["outliers"] == 0


def test_without_anything_small_a_clean_pair_is_perfect(subjects):
    none = replace(SETTINGS, small=Small(0, 0, 0, 0))
    candidate = draw_candidate(subjects[0].surface, np.zeros(3, bool), none, np.random.default_rng(3))
    assert np.array_equal(candidate.start(()), np.eye(4))
    assert len(candidate.observed(())) == len(candidate.clean)
    assert not KDTree(subjects[0].surface).query(candidate.clean)[0].any()


def test_a_clean_pair_drawn_again_is_as_large_and_starts_where_it_did(subjects):
    random = np.random.default_rng(3)
    first = draw_candidate(subjects[0].surface, np.zeros(3, bool), SETTINGS, random)
    second = redrawn(first, subjects[0].surface, random)
    assert [len(first.model), len(first.observed(()))] == [len(second.model), len(second.observed(()))]
    assert np.array_equal(first.start(()), second.start(()))
    assert not np.isin(second.model, first.model).all()


def test_model_and_observation_share_no_point(candidates):
    for candidate in candidates:
        shared = set(map(tuple, candidate.model.tolist())) & set(map(tuple, candidate.clean.tolist()))
        assert not shared


def test_each_cause_changes_what_it_should_and_nothing_else(candidates):
    candidate = candidates[0]
    clean, noisy, cropped = (candidate.observed(causes) for causes in ((), (0,), (2,)))
    assert np.array_equal(candidate.observed((1,)), clean)  # a pose error changes no point
    assert np.array_equal(clean, candidate.clean[candidate.seen])
    assert np.array_equal(noisy, candidate.noisy[candidate.seen])
    assert np.array_equal(cropped, candidate.clean[candidate.kept])
    assert np.array_equal(candidate.observed((0, 2)), candidate.noisy[candidate.kept])


def test_the_surface_is_cut_off_along_the_direction_that_it_says(candidates):
    for candidate in candidates:
        along = candidate.clean @ candidate.toward_hidden
        lost = np.delete(along, candidate.kept)
        assert along[candidate.kept].max() <= lost.min() + 2 * 5 * 0.003  # but for the least noise


def test_noise_is_as_strong_as_it_says_and_outliers_are_few(candidates):
    for candidate in candidates:
        offset = np.abs(candidate.noisy - candidate.clean)
        assert np.median(offset) == pytest.approx(0.6745 * candidate.severity["noise"], rel=0.5)
        assert np.abs(candidate.noisy).max() < 0.5 + 6 * candidate.severity["noise"]


def test_severities_of_what_is_not_applied_are_small(subjects):
    for k in range(20):
        drawn = draw_candidate(subjects[0].surface, np.array([False, True, False]), SETTINGS, np.random.default_rng(k))
        severity = drawn.severity
        assert severity["rotation_rad"] >= np.deg2rad(10)
        assert (severity["noise"] <= 0.003, severity["crop"] <= 0.05, severity["outliers"]) == (True, True, 0)


def test_every_subset_of_the_causes_is_drawn():
    random = np.random.default_rng(0)
    drawn = np.array([draw_applied(CauseSettings(present=0.25), random) for _ in range(2000)])
    assert drawn.mean(axis=0) == pytest.approx(0.25, abs=0.04)
    assert len(np.unique(drawn, axis=0)) == 8


def test_a_small_cloud_is_divided_between_the_two(subjects):
    candidate = draw_candidate(subjects[0].surface[:100], np.ones(3, bool), SETTINGS, np.random.default_rng(0))
    assert (len(candidate.model), len(candidate.clean)) == (50, 50)
    assert len(candidate.kept) >= 16
