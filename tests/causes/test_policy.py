import numpy as np
import pytest

from gpca.causes.policy import QUEUE, RecoveryPolicy, Thresholds, Treated, choose_uncertain
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS

POLICY = RecoveryPolicy(Thresholds(uncertain=0.3, dominant=0.4, improvement=0.1, attempts=3))


def scores(**given):
    return np.array([given[concept] for concept in CONCEPTS])


@pytest.mark.parametrize(
    ("concept", "action"), [("noise", "denoise"), ("pose", "reinitialize"), ("overlap", "new_view")]
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


def test_a_treatment_that_improved_too_little_is_followed_by_the_next_and_at_last_the_case_is_queued():
    said = scores(noise=0.1, pose=0.6, overlap=0.3)
    assert POLICY.decide(said, before=[Treated("pose", 0.05)]).action == "new_view"
    assert POLICY.decide(said, before=[Treated("pose", 0.15)]).action == "reinitialize"
    twice = [Treated("pose", 0.0), Treated("overlap", -0.2)]
    assert POLICY.decide(said, before=twice).action == "denoise"
    before = [Treated("pose", 0.0), Treated("overlap", 0.0), Treated("noise", 0.09)]
    assert POLICY.decide(said, before=before).action == QUEUE
    assert POLICY.decide(said, before=[*before[:2], Treated("noise", 0.11)]).action != QUEUE


def test_the_chosen_uncertainty_is_exceeded_by_the_declared_share_at_most_or_refused():
    bald_N = np.random.default_rng(0).permutation(20) / 20
    for share, above in ((0.0, 0), (0.04, 0), (0.05, 1), (0.25, 5)):
        assert (bald_N > choose_uncertain(bald_N, share)).sum() == above
    assert choose_uncertain(np.array([0.2]), 0.5) == 0.2
    with pytest.raises(InputError, match="no calibration samples"):
        choose_uncertain(np.zeros(0), 0.5)
    with pytest.raises(InputError, match=r"not in \[0, 1\)"):
        choose_uncertain(np.zeros(3), 1.0)


def test_the_policy_of_a_config_chooses_only_what_is_not_declared():
    thresholds = {"uncertain": None, "queued_share": 0.25, "dominant": 0.4, "improvement": 0.1}
    bald_N = np.arange(8) / 8
    chosen = RecoveryPolicy.of_settings(thresholds, {"pose": "reinitialize"}, 2, bald_N)
    assert chosen.thresholds == Thresholds(0.625, 0.4, 0.1, 2)
    assert chosen.treatments == {"pose": "reinitialize"}
    declared = RecoveryPolicy.of_settings(thresholds | {"uncertain": 0.2}, {}, 2, bald_N)
    assert declared.thresholds.uncertain == 0.2


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
