"""Boosted trees as plain arrays say what scikit-learn's say."""

import numpy as np
import pytest

from gpca.explainers.boosted_trees import BoostedQuestion, boosted_trees, require_trees


@pytest.fixture(scope="module")
def samples():
    random = np.random.default_rng(0)
    inputs_N_F = random.normal(size=(200, 6))
    return inputs_N_F, inputs_N_F[:, 0] + inputs_N_F[:, 1] ** 2 + 0.3 * random.normal(size=200) > 0.5


def test_they_say_what_scikit_learn_says_also_after_the_way_to_a_file(samples):
    inputs_N_F, yes_N = samples
    asked = np.concatenate([inputs_N_F, 2 * np.random.default_rng(1).normal(size=(50, 6))])
    question = BoostedQuestion.fit(inputs_N_F, yes_N, "tiny", 0)
    expected = boosted_trees("tiny", 0).fit(inputs_N_F, yes_N).predict_proba(asked)[:, 1]
    np.testing.assert_allclose(question.probability(asked), expected, atol=1e-12)
    state = question.state()
    require_trees(state, 6)
    loaded = BoostedQuestion.from_state(state)
    assert loaded.probability(asked).tobytes() == question.probability(asked).tobytes()
    assert loaded.probability(asked[:1])[0] == question.probability(asked)[0]


@pytest.mark.parametrize("answer", [False, True])
def test_a_single_answer_needs_no_tree(samples, answer):
    inputs_N_F, yes_N = samples
    question = BoostedQuestion.fit(inputs_N_F, np.full(len(yes_N), answer), "tiny", 0)
    require_trees(question.state(), 6)
    assert (question.probability(inputs_N_F[:3]) > 0.5).tolist() == [answer] * 3


def test_few_samples_are_not_split(samples):
    inputs_N_F, yes_N = samples
    question = BoostedQuestion.fit(inputs_N_F[:10], yes_N[:10], "tiny", 0)
    require_trees(question.state(), 6)
    assert np.ptp(question.probability(inputs_N_F)) == 0
