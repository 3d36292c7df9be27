"""Forms of the truth's generator: each changes what it says, and nothing else."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.causes.candidate import PATCHES, Registrar, draw_candidate, redrawn, smooth_field, visible_rows
from gpca.causes.drawing import draw_shifted
from gpca.causes.settings import CauseSettings, CauseSeverities, Form
from gpca.pairs.perturbation import NOISE, OVERLAP

SEVERITIES = CauseSeverities(outliers=(0.1, 0.2), noise=(0.03, 0.03), crop=(0.4, 0.4))


def drawn(subjects, applied=(True, True, True), seed=0, **form):
    settings = CauseSettings(severities=SEVERITIES, points=(512, 512), form=Form(**form))
    return draw_candidate(subjects[0].surface, np.array(applied), settings, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("form", "changed"),
    [
        ({"occlusion": "patches"}, "kept"),
        ({"noise": "warped"}, "noisy"),
        ({"noise": "quantized"}, "noisy"),
        ({"outliers": "clustered"}, "noisy"),
        ({"scale": 0.02}, "model"),
        ({"lacking": 0.2}, "model"),
    ],
)
def test_a_form_changes_one_part_of_a_candidate(subjects, form, changed):
    usual, other = drawn(subjects), drawn(subjects, **form)
    for name in ("model", "clean", "noisy", "seen", "kept", "T_init", "T_near"):
        assert np.array_equal(getattr(usual, name), getattr(other, name)) == (name != changed)


def test_patches_are_connected_and_as_large_as_a_half_space_would_be(subjects):
    candidate = drawn(subjects, occlusion="patches")
    hidden = np.setdiff1d(np.arange(len(candidate.clean)), candidate.kept)
    assert len(candidate.kept) == len(drawn(subjects).kept)
    near = cKDTree(candidate.clean[hidden]).query_pairs(0.08, output_type="ndarray")
    group = np.arange(len(hidden))
    for _ in range(len(hidden)):
        np.minimum.at(group, near[:, 0], group[near[:, 1]])
        np.minimum.at(group, near[:, 1], group[near[:, 0]])
    counts = np.unique(group, return_counts=True)[1]
    assert np.sort(counts)[-PATCHES:].sum() > 0.95 * len(hidden)


def test_from_one_side_the_near_half_of_a_sphere_is_visible_and_a_severity_is_what_it_hides(subjects):
    points = np.random.default_rng(0).normal(size=(2000, 3))
    points /= 2 * np.linalg.norm(points, axis=1, keepdims=True)
    visible = np.zeros(2000, bool)
    visible[visible_rows(points, np.array([0.0, 0.0, 1.0]))] = True
    assert visible[points[:, 2] < -0.15].mean() > 0.95 and visible[points[:, 2] > 0].mean() < 0.05
    candidate = drawn(subjects, occlusion="visibility")
    assert candidate.severity["crop"] == 1 - len(candidate.kept) / len(candidate.clean)
    assert drawn(subjects, (True, True, False), occlusion="visibility").severity["crop"] <= 0.05


def test_a_warp_is_smooth_and_moves_the_object_nowhere():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, size=(800, 3))
    field = smooth_field(points, np.random.default_rng(1))
    assert np.square(field).mean() == pytest.approx(1)
    assert np.abs(field.mean(axis=0)).max() < 1e-9 and np.abs(np.cross(points, field).mean(axis=0)).max() < 1e-9
    pairs = cKDTree(points).query_pairs(0.03, output_type="ndarray")
    assert np.square(field[pairs[:, 0]] - field[pairs[:, 1]]).mean() < 0.1


def test_quantized_noise_lies_in_layers_and_is_as_strong_as_it_says(subjects):
    candidate = drawn(subjects, noise="quantized")
    inlier = np.linalg.norm(candidate.noisy - candidate.clean, axis=1) < 0.06
    along = candidate.noisy[inlier] @ candidate.form.toward
    assert len(np.unique(along.round(6))) < 20
    assert (candidate.noisy - candidate.clean)[inlier].std(axis=0).max() < 0.04


def test_a_model_may_be_of_the_wrong_size_or_lack_what_is_beyond_a_plane(subjects):
    factors = [drawn(subjects, seed=k, scale=0.02).model / drawn(subjects, seed=k).model for k in range(8)]
    means = np.array([np.median(factor) for factor in factors])
    assert set(means.round(4)) == {1.02, round(1 / 1.02, 4)}
    candidate = drawn(subjects, lacking=0.3)
    assert len(candidate.model) == 512 and candidate.whole_model is None
    along = subjects[0].surface @ candidate.form.toward
    assert (along <= (candidate.model @ candidate.form.toward).max()).mean() == pytest.approx(0.7, abs=0.02)
    assert np.array_equal(candidate.reference(()), candidate.reference((NOISE, OVERLAP)))


def test_a_table_is_there_with_every_subset_of_the_causes(subjects):
    candidate = drawn(subjects, clutter=0.2)
    beyond = (subjects[0].surface @ candidate.form.down).max() - 0.02
    for causes in ((), (NOISE,), (OVERLAP,), (NOISE, OVERLAP)):
        observed = candidate.observed(causes)
        assert (observed[-candidate.beside :] @ candidate.form.down > beyond - 0.1).all()
        assert candidate.beside / len(observed) == pytest.approx(0.2, abs=0.04 if OVERLAP in causes else 0.1)
    clean = drawn(subjects, (False, False, False), clutter=0.2)
    again = redrawn(clean, subjects[0].surface, np.random.default_rng(1))
    assert again.clean.shape == clean.clean.shape and again.seen.shape == clean.seen.shape


@pytest.mark.parametrize("method", ["point_to_plane", "generalized"])
def test_candidates_are_registered_by_other_methods(subjects, method):
    settings = CauseSettings.from_dict({}, {"method": method})
    candidate = draw_candidate(subjects[2].surface, np.zeros(3, bool), settings, np.random.default_rng(0))
    runs = Registrar(candidate, settings).run((), np.zeros((1, 6)))
    assert subjects[2].errors(np.linalg.inv(runs.T_target_source_n))[0] < 0.01


def test_groups_that_a_shift_cannot_fill_stay_smaller(four):
    limits = {"nominal": 0.049, "failed": 0.05}
    settings = CauseSettings.from_dict(
        {"test": 8, "candidates": 2, "clean_pairs": 20, "points": [128, 256], "limits": limits}
    )
    causes, tally, _ = draw_shifted(four, "four", 100, settings)
    assert 0 < len(causes) <= 8 and set(causes.truth.state) <= {"nominal", "failed"}
    assert len(causes.truth_again) == len(causes) and tally.total() <= 16
