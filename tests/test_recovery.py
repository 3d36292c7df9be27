import numpy as np
import pytest

from gpca.errors import InputError
from gpca.perturbation import CONCEPTS
from gpca.recovery import FEWEST_ABOVE, QUEUE, RecoveryPolicy, Thresholds, Treated, choose_uncertain

POLICY = RecoveryPolicy(Thresholds(uncertain=0.3, dominant=0.4, improvement=0.1, attempts=3))


def scores(**given):
    return np.array([given[concept] for concept in CONCEPTS])


@pytest.mark.parametrize(
    ("concept", "action"), [("noise", "denoise"), ("pose", "reinitialise"), ("overlap", "new_view")]
)
def test_the_dominant_concept_is_treated(concept, action):
    said = np.where(np.array(CONCEPTS) == concept, 0.6, 0.2)
    decision = POLICY.decide(said, bald=0.1)
    assert (decision.action, decision.concept) == (action, concept)
    assert "0.60" in decision.reason


def test_what_is_uncertain_or_has_no_dominant_concept_is_queued():
    sure = scores(noise=0.8, pose=0.1, overlap=0.1)
    assert POLICY.decide(sure, bald=0.30).action == "denoise"
    assert POLICY.decide(sure, bald=0.31).action == QUEUE
    even = scores(noise=0.39, pose=0.31, overlap=0.30)
    assert "no concept dominates" in POLICY.decide(even).reason


def test_a_treatment_that_improved_too_little_is_followed_by_the_next_concept():
    said = scores(noise=0.1, pose=0.6, overlap=0.3)
    assert POLICY.decide(said, before=[Treated("pose", 0.05)]).action == "new_view"
    assert POLICY.decide(said, before=[Treated("pose", 0.15)]).action == "reinitialise"
    twice = [Treated("pose", 0.0), Treated("overlap", -0.2)]
    assert POLICY.decide(said, before=twice).action == "denoise"


def test_after_attempts_without_improvement_a_case_is_queued():
    said = scores(noise=0.1, pose=0.6, overlap=0.3)
    before = [Treated("pose", 0.0), Treated("overlap", 0.0), Treated("noise", 0.09)]
    assert POLICY.decide(said, before=before).action == QUEUE
    assert POLICY.decide(said, before=[*before[:2], Treated("noise", 0.11)]).action != QUEUE


def test_a_concept_that_nothing_treats_is_queued():
    policy = RecoveryPolicy(treatments={"pose": "reinitialise"})
    assert policy.decide(scores(noise=0.8, pose=0.1, overlap=0.1)).action == QUEUE
    assert policy.decide(scores(noise=0.1, pose=0.8, overlap=0.1)).action == "reinitialise"


def test_the_chosen_uncertainty_is_the_lowest_above_which_most_are_wrong():
    bald_N = np.arange(20) / 20
    right_N = np.arange(20) < 12  # the eight most uncertain are wrong
    chosen = choose_uncertain(bald_N, right_N, 0.5)
    above = right_N[bald_N > chosen]
    assert above.mean() < 0.5
    lower = bald_N[bald_N < chosen]
    assert all(right_N[bald_N > value].mean() >= 0.5 for value in lower)
    order = np.random.default_rng(0).permutation(20)
    assert choose_uncertain(bald_N[order], right_N[order], 0.5) == chosen


def test_where_none_is_mostly_wrong_only_what_is_more_uncertain_than_all_is_queued():
    bald_N = np.linspace(0, 0.4, 30)
    assert choose_uncertain(bald_N, np.ones(30, bool), 0.5) == 0.4
    few_wrong = np.arange(30) < 30 - FEWEST_ABOVE // 2  # too few to tell
    assert choose_uncertain(bald_N, few_wrong, 0.5) == 0.4


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({"dominant": 1.2}, "not both in"),
        ({"improvement": -0.1}, "not both in"),
        ({"improvement": 0.5, "dominant": 0.4}, "not below dominant"),
        ({"uncertain": -1.0}, "uncertainty of 0 or more"),
        ({"uncertain": float("nan")}, "uncertainty of 0 or more"),
        ({"attempts": 0}, "at least 1 attempt"),
    ],
)
def test_thresholds_out_of_order_or_range_are_refused(given, fault):
    with pytest.raises(InputError, match=fault):
        Thresholds(**given)


def test_no_calibration_samples_and_a_share_out_of_range_are_refused():
    with pytest.raises(InputError, match="no calibration samples"):
        choose_uncertain(np.zeros(0), np.zeros(0, bool), 0.5)
    with pytest.raises(InputError, match=r"not in \(0, 1\]"):
        choose_uncertain(np.zeros(3), np.ones(3, bool), 0.0)
