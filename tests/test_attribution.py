import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.attribution import Attribution, entropy, read_timings, summarise_draws, write_predictions, write_timings
from gpca.errors import InputError
from gpca.metrics import read_predictions
from gpca.perturbation import CONCEPTS


def attribution(n, seed=0, **changed):
    random = np.random.default_rng(seed)
    scores, variances, bald = summarise_draws(random.normal(size=(50, n, 3)))
    zeros = np.zeros(n)
    made = Attribution(CONCEPTS, scores, variances, bald, zeros.astype(bool), zeros.astype(int), zeros, zeros)
    return dataclasses.replace(made, **changed)


def test_draws_are_summarised_as_the_paper_writes():
    logits_M_N_C = np.random.default_rng(0).normal(scale=3, size=(40, 5, 3))
    scores, variances, bald = summarise_draws(logits_M_N_C)
    for n in range(5):
        draws = []
        for m in range(40):  # Eq. 2
            exponentials = [np.exp(f) for f in logits_M_N_C[m, n]]
            draws.append([e / sum(exponentials) for e in exponentials])
        mean = [sum(draw[c] for draw in draws) / 40 for c in range(3)]  # Eq. 4
        variance = [sum((draw[c] - mean[c]) ** 2 for draw in draws) / 40 for c in range(3)]  # Eq. 5
        entropy_of_mean = -sum(p * np.log(p) for p in mean)
        mean_of_entropy = sum(-sum(p * np.log(p) for p in draw) for draw in draws) / 40
        assert scores[n] == pytest.approx(mean)
        assert variances[n] == pytest.approx(variance)
        assert bald[n] == pytest.approx(entropy_of_mean - mean_of_entropy)  # Eq. 7


@pytest.mark.parametrize("logits", [[0.0, 0.0, 0.0], [2.0, -1.0, 0.5], [900.0, 0.0, -900.0]])
def test_draws_that_agree_leave_no_epistemic_uncertainty(logits):
    _, variances, bald = summarise_draws(np.tile(logits, (60, 2, 1)))
    assert np.abs(variances).max() < 1e-12
    assert np.abs(bald).max() < 1e-12


def test_draws_that_disagree_confidently_have_bald_of_log_c():
    scores, variances, bald = summarise_draws(1000.0 * np.eye(3)[np.arange(60) % 3][:, None])
    assert scores[0] == pytest.approx(1 / 3)
    assert variances[0] == pytest.approx(1 / 3 * 2 / 3)
    assert bald[0] == pytest.approx(np.log(3))


def test_a_constant_added_to_all_logits_changes_nothing():
    logits = np.random.default_rng(0).normal(size=(10, 4, 3))
    for one, other in zip(summarise_draws(logits), summarise_draws(logits + 1e4), strict=True):
        assert np.allclose(one, other, atol=1e-9)


def test_entropy_is_in_nats_and_takes_zeros():
    assert entropy(np.array([[1.0, 0, 0], [0.5, 0.5, 0], [1 / 3] * 3])) == pytest.approx([0, np.log(2), np.log(3)])


def test_the_largest_score_names_the_concept_and_ties_go_to_the_first():
    scores = np.array([[0.2, 0.3, 0.5], [0.4, 0.4, 0.2], [0.2, 0.4, 0.4], [1 / 3, 1 / 3, 1 / 3], [0.1, 0.8, 0.1]])
    made = attribution(5, scores_N_C=scores, abstained_N=np.array([False] * 4 + [True]))
    assert made.predicted_N.tolist() == ["overlap", "noise", "pose", "noise", ""]


def test_entropy_is_that_of_the_normalised_scores():
    made = attribution(2, scores_N_C=np.array([[2.0, 2.0, 0.0], [5.0, 0.0, 0.0]]))
    assert made.entropy_N == pytest.approx([np.log(2), 0])


def test_the_prediction_file_has_the_columns_and_values_of_the_schema(tmp_path, registrations):
    made = attribution(len(registrations), abstained_N=np.arange(len(registrations)) == 4)
    path = tmp_path / "ycb" / "gpca" / "seed0.csv"
    write_predictions(path, registrations, made)
    rows = read_predictions(path)
    assert list(rows.columns) == [
        *("sample", "split", "object", "concept_true", "concept_predicted"),
        *("score_noise", "score_pose", "score_overlap", "variance_noise", "variance_pose", "variance_overlap"),
        *("bald", "entropy", "abstained", "icp_calls"),
    ]
    assert rows["sample"].astype(int).tolist() == registrations.sample.tolist()
    assert rows["object"].tolist() == registrations.object_name.tolist()
    assert rows["concept_true"].tolist() == registrations.concept.tolist()
    assert rows["concept_predicted"].tolist() == made.predicted_N.tolist()
    assert rows.loc[4, "concept_predicted"] == "" and rows["abstained"].sum() == 1
    assert np.allclose(rows.filter(like="score_"), made.scores_N_C, atol=5.1e-7)
    assert np.allclose(rows.filter(like="variance_"), made.variances_N_C, atol=5.1e-7)
    assert np.allclose(rows["bald"].astype(float), made.bald_N, atol=5.1e-7)


def test_an_explainer_without_variances_and_bald_leaves_them_empty(tmp_path, registrations):
    n, path = len(registrations), tmp_path / "seed0.csv"
    nothing = {"variances_N_C": np.full((n, 3), np.nan), "bald_N": np.full(n, np.nan)}
    write_predictions(path, registrations, attribution(n, **nothing))
    rows = read_predictions(path)
    assert rows.filter(like="variance_").isna().all(axis=None)
    assert set(rows["bald"]) == {""}


def test_the_same_predictions_give_the_same_bytes(tmp_path, registrations):
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        write_predictions(tmp_path / name, registrations, attribution(len(registrations), seed))
    first, second, other = ((tmp_path / name).read_bytes() for name in "abc")
    assert first == second != other


def test_timings_survive_the_file_and_must_be_of_the_same_samples(tmp_path):
    path = tmp_path / "seed0.csv"
    sample = SimpleNamespace(sample=np.array([3, 3]), split=np.array(["train", "test"]))
    with pytest.raises(InputError, match="no such file"):
        read_timings(path, sample)
    write_timings(path, sample, np.array([0.5, 0.25]), np.array([0.125, 0.0]))
    seconds, icp_seconds = read_timings(path, sample)
    assert (seconds.tolist(), icp_seconds.tolist()) == ([0.5, 0.25], [0.125, 0.0])
    fewer = SimpleNamespace(sample=sample.sample[:1], split=sample.split[:1])
    other = SimpleNamespace(sample=sample.sample, split=sample.split[::-1])
    for wrong in (fewer, other):
        with pytest.raises(InputError, match="does not hold the seconds of these samples") as caught:
            read_timings(path, wrong)
        assert str(path) in str(caught.value)
