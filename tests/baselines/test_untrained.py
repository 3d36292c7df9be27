from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from baselines.gates import GATES, NominalThreshold, motion_alarm
from baselines.untrained import CAUSE_EXPLAINERS, EXPLAINERS
from gpca.causes.dataset import LABELS
from gpca.causes.settings import MOTION
from gpca.pairs.dataset import ragged
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import rigid_motion


def explained(registrations, name, of=EXPLAINERS, train=None, **settings):
    explainer = of[name].make("tiny", 100, **settings)
    explainer.fit(registrations if train is None else train)
    return explainer.explain(registrations.without_labels())


def turned(registrations, degrees):
    """The same, each turned by ICP about an axis by as much."""
    turn = rigid_motion(Rotation.from_euler("x", degrees, degrees=True).as_matrix())
    return replace(registrations, T_target_source_icp=turn @ registrations.T_target_source_init)


def test_the_rule_reads_the_angle_and_then_the_numbers_of_points(registrations):
    found = explained(registrations, "rule")
    assert (found.predicted_N == registrations.concept).mean() > 0.9
    assert sorted(set(found.scores_N_C.ravel())) == [0, 1]
    row = registrations.subset(np.array([0, 0, 0]))
    target = row.target(0)
    clouds = [target[: round(share * len(target))] for share in (0.94, 0.96, 1.5)]
    counted = replace(row, **ragged(clouds, [target] * 3))
    assert explained(turned(counted, 4.9), "rule").predicted_N.tolist() == ["overlap", "noise", "noise"]
    assert explained(turned(counted, 5.1), "rule").predicted_N.tolist() == ["pose"] * 3
    settings = {"turned_deg": 10, "complete": 0.9}
    assert explained(turned(counted, 5.1), "rule", **settings).predicted_N.tolist() == ["noise"] * 3


@pytest.mark.parametrize(("of", "labels"), [(EXPLAINERS, CONCEPTS), (CAUSE_EXPLAINERS, LABELS)])
def test_chance_names_all_labels_alike_whatever_it_sees_and_by_the_sample_alone(registrations, of, labels):
    many = registrations.subset(np.arange(900) % len(registrations))
    many = replace(many, sample=np.arange(900))
    found = explained(many, "chance", of)
    shares = [(found.predicted_N == label).mean() for label in labels]
    assert shares == pytest.approx(np.full(len(labels), 1 / len(labels)), abs=0.06)
    assert found.scores_N_C == pytest.approx(np.full((900, len(labels)), 1 / len(labels)), abs=2e-3)
    few = explained(many.subset(np.array([17, 3])), "chance", of)
    assert np.array_equal(few.scores_N_C, found.scores_N_C[[17, 3]])
    other = of["chance"].make("tiny", 101).explain(many)
    assert (other.predicted_N != found.predicted_N).any()
    scores = found.scores_N_C  # whose order survives six decimals
    assert np.array_equal(scores.round(6).argsort(axis=1), scores.argsort(axis=1))


def test_the_most_frequent_label_is_that_of_training(registrations):
    label = np.array(["overlap", "nominal", "overlap", "noise"])
    train = replace(registrations.subset(np.arange(4)), concept=label)
    found = explained(registrations, "most_frequent", CAUSE_EXPLAINERS, train)
    assert set(found.predicted_N) == {"overlap"}
    assert found.scores_N_C[0].tolist() == [0.25, 0.25, 0, 0.5]


def test_the_rule_for_causes_takes_the_gate_that_tells_nominal_best_in_training(registrations):
    count, random = len(registrations), np.random.default_rng(0)
    failed = np.arange(count) % 3 > 0
    label = np.where(failed, registrations.concept, "nominal")
    for best in GATES:
        motion = random.normal(size=(count, len(MOTION)))
        motion[:, MOTION.index(best)] = np.where(failed, 5, -5) * (-1 if best == "fitness" else 1)
        seen = replace(registrations, concept=label, attached={"motion": motion})
        found = explained(seen, "rule", CAUSE_EXPLAINERS)
        assert ((found.predicted_N == "nominal") == ~failed).all()
        plain = explained(registrations, "rule").predicted_N
        assert (found.predicted_N == plain)[failed].all()
        assert NominalThreshold().fit(motion_alarm(seen, best), label).accuracy == 1
