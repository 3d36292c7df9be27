"""What is called repaired is calibrated on families that the judge did not learn."""

import numpy as np

from gpca.model.proposed import Proposed, joined, with_repair
from gpca.model.repair import Proposals
from gpca.model.result import Calibrated, Evidence

TOLERANCE = 0.03


def proposed(random, families, each=20):
    """Registrations of which half failed, two proposals, and evidence that is mostly right about all three."""
    count = families * each
    error_N_P = np.where(random.random((count, 3)) < 0.5, 0.005, 0.2)
    misled_N_P = random.random((count, 3)) < 0.15
    apart_N_P = np.where(misled_N_P, random.choice([0.01, 0.1], (count, 3)), error_N_P)
    distance_N_P_K = apart_N_P[:, :, None] * random.lognormal(0, 0.5, (count, 3, 2))
    fitness_N_P = np.where(error_N_P > TOLERANCE, 0.5, 0.9) + random.normal(0, 0.1, (count, 3))
    weight_N_P = np.tile([0.0, 0.7, 0.3], (count, 1))
    family_N = np.array([f"family {number}" for number in np.repeat(np.arange(families), each)])
    hypothesis_N_P_K, rmse_N_P = np.tile([0.7, 0.3], (count, 3, 1)), distance_N_P_K[..., 0]
    measured = rmse_N_P, fitness_N_P.clip(0, 1)
    return Proposed(error_N_P, weight_N_P, distance_N_P_K, hypothesis_N_P_K, *measured, family_N)


def test_few_of_the_poses_that_are_called_repaired_are_wrong():
    random = np.random.default_rng(2)
    wrong, repaired = 0, 0
    for _ in range(5):
        known, new = proposed(random, 15), proposed(random, 60)
        [level] = with_repair([Calibrated(TOLERANCE, 0.5)], known)
        probability_N_P = new.probabilities(known.judge(), TOLERANCE)
        best_N = 1 + probability_N_P[:, 1:].argmin(axis=1)
        called = np.flatnonzero(probability_N_P[:, 0] >= level.threshold)
        called = called[probability_N_P[called, best_N[called]] < level.good_below]
        wrong += (new.error_N_P[called, best_N[called]] > TOLERANCE).sum()
        repaired += len(called)
    assert repaired > 500 and wrong / repaired <= 0.05


def test_too_few_registrations_promise_nothing():
    [level] = with_repair([Calibrated(TOLERANCE, 0.5)], proposed(np.random.default_rng(0), 4, each=5))
    assert level.repaired_below is None


def test_the_first_proposal_fills_up_where_there_are_fewer():
    def of(count):
        weight_K = np.tile([0.3, 0.2, 0.5], (count, 1))  # of two hypotheses and another estimate
        evidence = Evidence(np.full((count, 3), 0.1), weight_K, np.arange(count), np.ones(count))
        return Proposals(np.tile(np.eye(4), (count, 1, 1)), np.array([0.0, 0.6, 0.4])[:count], evidence)

    both = joined([of(3), of(2)], [np.array([0.2, 0.01, 0.3]), np.array([0.2, 0.01])], np.array(["a", "b"]))
    assert both.error_N_P.tolist() == [[0.2, 0.01, 0.3], [0.2, 0.01, 0.01]]
    assert both.weight_N_P.tolist() == [[0, 0.6, 0.4], [0, 0.6, 0]]
    assert both.at(1).evidence.inlier_rmse_N.tolist() == [0, 1, 1]
