from dataclasses import replace

import numpy as np
import pytest

from baselines.learned_pair import EXPLAINERS
from gpca.pairs.perturbation import CONCEPTS

SETTINGS = {"points": 64, "draw_points": 32, "epochs": 4, "iterations": 40, "learning_rate": 0.1, "inducing": 12}


@pytest.mark.parametrize("name", EXPLAINERS)
def test_concepts_are_told_apart_by_an_encoder_of_its_own_or_by_embeddings_that_it_attached(registrations, name):
    train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
    alone, after = (EXPLAINERS[name].make("tiny", 100, **SETTINGS, draws=50) for _ in range(2))
    alone.fit(train)
    found = alone.explain(test.without_labels())
    assert found.concepts == CONCEPTS
    if name.endswith("_clouds"):  # of so few samples the points alone teach it nothing
        off = test.T_target_source_init.copy()
        off[:, :3, 3] += 0.1
        elsewhere = alone.explain(replace(test, T_target_source_init=off).without_labels())
        assert np.array_equal(elsewhere.scores_N_C, found.scores_N_C)
    else:
        assert (found.predicted_N == test.concept).mean() > 0.6

    attach = EXPLAINERS[name].make("tiny", 100, **SETTINGS, draws=50).learn_encoder(train)
    after.fit(attach(train))
    again = after.explain(attach(test).without_labels())
    assert np.array_equal(again.scores_N_C, found.scores_N_C)
