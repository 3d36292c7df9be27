from dataclasses import replace

import numpy as np
import pytest

from baselines.pair import EXPLAINERS
from gpca.pairs.perturbation import CONCEPTS

SETTINGS = {
    "gpca_pair": {"points": 128, "iterations": 60, "learning_rate": 0.1, "inducing": 12, "draws": 50},
    "gpca_pair_clouds": {"points": 128, "iterations": 60, "learning_rate": 0.1, "inducing": 12, "draws": 50},
    "pair_forest": {"points": 128, "trees": 50},
    "density": {"points": 128},
}


@pytest.mark.parametrize("name", EXPLAINERS)
def test_concepts_are_told_apart_and_the_description_is_kept(registrations, name):
    train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
    scores = []
    for kept in (False, True):
        explainer = EXPLAINERS[name].make("tiny", 100, **SETTINGS[name])
        explainer.fit(explainer.describe(train) if kept else train)
        observed = test.without_labels()
        found = explainer.explain(explainer.describe(observed) if kept else observed)
        scores.append(found.scores_N_C)
        assert found.concepts == CONCEPTS
        assert found.scores_N_C.sum(axis=1) == pytest.approx(np.ones(len(test)), abs=1e-4)
    assert np.array_equal(*scores)
    assert (found.predicted_N == test.concept).mean() > 0.6


def test_what_is_described_is_not_described_again(registrations):
    explainer = EXPLAINERS["density"].make("tiny", 100, points=64)
    described = explainer.describe(registrations)
    assert explainer.describe(described) is described
    part = described.subset(np.array([3, 5]))
    alone = replace(registrations.subset(np.array([3, 5])), attached={})
    assert np.allclose(explainer.features(part), explainer.features(alone))


def test_without_motion_it_does_not_matter_where_icp_started(registrations):
    off = registrations.T_target_source_init.copy()
    off[:, :3, 3] += 0.1
    elsewhere = replace(registrations, T_target_source_init=off)
    for name, alike in (("gpca_pair", False), ("gpca_pair_clouds", True)):
        explainer = EXPLAINERS[name].make("tiny", 100, points=64)
        features = [explainer.features(seen) for seen in (registrations, elsewhere)]
        assert np.array_equal(*features) == alike
        assert features[0].shape[1] == (32 if alike else 35)
