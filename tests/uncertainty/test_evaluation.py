import numpy as np
import pytest

from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty import designs
from gpca.uncertainty.designs import DESIGNS, design_rows, evaluate_design
from gpca.uncertainty.settings import CONDITIONS, UncertaintySettings
from gpca.uncertainty.spread import divergence

SETTINGS = UncertaintySettings(starts=13, icp_points=60)


def evaluate(design, registrations, rows, source="tiny", seed=0, settings=SETTINGS):
    return evaluate_design(design, registrations.subset(np.asarray(rows)), source, seed, settings)


def test_without_a_number_all_rows_of_the_designs_splits_are_evaluated(registrations):
    for name, design in DESIGNS.items():
        rows = design_rows(registrations, name, None)
        assert np.array_equal(rows, np.flatnonzero(np.isin(registrations.split, design.splits)))
        assert len(rows) == (54 if "train" in design.splits else 18)


@pytest.mark.parametrize("samples", [3, 6, 9, 18])
def test_the_first_test_samples_are_balanced_over_concepts_and_objects(registrations, samples):
    rows = design_rows(registrations, "additive", samples)
    assert (registrations.split[rows] == "test").all()
    assert registrations.sample[rows].tolist() == list(range(samples))
    assert set(np.unique(registrations.concept[rows], return_counts=True)[1]) == {samples // 3}
    of_object = np.bincount(registrations.object_index[rows], minlength=3)
    assert np.ptp(of_object) <= 3


def test_training_rows_are_all_kept_and_the_first_samples_are_chosen_by_number_not_by_place(registrations):
    shuffled = registrations.subset(np.random.default_rng(0).permutation(len(registrations)))
    for design, train in (("removal", 36), ("additive", 0)):
        rows = design_rows(shuffled, design, 6)
        assert (shuffled.split[rows] == "train").sum() == train
        assert sorted(shuffled.sample[rows[shuffled.split[rows] == "test"]]) == list(range(6))


def test_numbers_that_do_not_balance_the_concepts_and_nothing_to_evaluate_are_refused(registrations):
    for samples in (1, 2, 4, 200):
        with pytest.raises(InputError, match=rf"'additive': {samples} samples do not balance .* multiple of 3"):
            design_rows(registrations, "additive", samples)
    with pytest.raises(InputError, match="'causal': has no registrations"):
        design_rows(registrations, "causal", 0)
    with pytest.raises(InputError, match="'additive': has no registrations"):
        design_rows(registrations.subset(registrations.rows("train")), "additive", None)


@pytest.mark.parametrize("design", DESIGNS)
def test_outcomes_are_finite_and_measured_against_the_reference(registrations, design):
    entry = DESIGNS[design]
    rows = design_rows(registrations, design, 3)[-3:]
    outcomes, seconds_S_K, icp_seconds_S_K = evaluate(design, registrations, rows)
    shape = (3, len(CONDITIONS[design]))
    assert outcomes.sample.tolist() == registrations.sample[rows].tolist()
    assert outcomes.split.tolist() == registrations.split[rows].tolist()
    assert outcomes.covariance.shape == (*shape, 6, 6)
    for array in (outcomes.uncertainty, outcomes.residual, outcomes.degenerate, outcomes.icp_calls):
        assert array.shape == shape and np.isfinite(array).all()
    assert np.allclose(outcomes.uncertainty[:, entry.reference], 0, atol=1e-6)
    for k in range(shape[1]):
        clean, other = outcomes.covariance[1, entry.reference], outcomes.covariance[1, k]
        assert outcomes.uncertainty[1, k] == pytest.approx(divergence(clean, other, SETTINGS.floor), rel=1e-6, abs=1e-6)
    assert shape[1] == 1 or outcomes.uncertainty.max() > 0.5
    assert outcomes.icp_calls.max() == 13
    assert seconds_S_K.shape == icp_seconds_S_K.shape == shape
    assert (seconds_S_K >= icp_seconds_S_K).all() and (icp_seconds_S_K[outcomes.icp_calls > 0] > 0).all()


def test_source_seed_and_split_name_the_random_numbers(registrations):
    row = registrations.rows("test")[:1]
    made = {
        evaluate("causal", registrations, row, source, seed)[0].covariance.tobytes()
        for source, seed in (("tiny", 0), ("tiny", 0), ("other", 0), ("tiny", 1))
    }
    assert len(made) == 3


def test_the_settings_decide(registrations):
    row = registrations.rows("test")[:1]
    made, _, _ = evaluate("causal", registrations, row)
    more, _, _ = evaluate("causal", registrations, row, settings=UncertaintySettings(starts=20, icp_points=60))
    assert (made.icp_calls == 13).all() and (more.icp_calls == 20).all()
    higher, _, _ = evaluate("causal", registrations, row, settings=UncertaintySettings(13, icp_points=60, floor=1e-2))
    assert np.array_equal(higher.covariance, made.covariance)
    assert (higher.uncertainty[:, 1:] < made.uncertainty[:, 1:]).all()


@pytest.mark.parametrize("design", DESIGNS)
def test_what_was_perturbed_is_hidden_from_all_but_the_oracle(registrations, monkeypatch, design):
    shown = []

    class Recorded(designs.RegisteredRow):
        def __init__(self, registrations, row):
            shown.append(registrations)
            super().__init__(registrations, row)

    monkeypatch.setattr(designs, "RegisteredRow", Recorded)
    evaluate(design, registrations, registrations.rows("test")[:1])
    (given,) = shown
    told = given.concept[0] in CONCEPTS and np.isfinite(given.severity_noise[0])
    assert told == (design == "oracle") == DESIGNS[design].oracle
    if told:
        with pytest.raises(InputError, match="contains NaN"):
            evaluate(design, registrations.without_labels(), registrations.rows("test")[:1])
