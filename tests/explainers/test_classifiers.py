import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression

from gpca.errors import InputError
from gpca.explainers.classifiers import BoostedQuestion, boosted_trees, known_concepts, require_trees, scores_of
from gpca.pairs.perturbation import CONCEPTS

CONCEPT_N = np.array(CONCEPTS)[np.arange(60) % 3]
CENTERS = np.array([[-3.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
X = CENTERS[np.arange(60) % 3] + np.random.default_rng(0).normal(size=(60, 2))


@pytest.mark.parametrize("absent", [*CONCEPTS, None])
def test_columns_are_the_concepts_although_scikit_learn_sorts_them_and_an_absent_one_scores_0(absent):
    seen = absent != CONCEPT_N
    scores = scores_of(LogisticRegression().fit(X[seen], CONCEPT_N[seen]), CENTERS)
    others = [c for c in range(3) if CONCEPTS[c] != absent]
    assert (np.delete(scores, others, axis=1) == 0).all()
    assert scores.argmax(axis=1)[others].tolist() == others
    assert scores.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize("rows", [[0, 3, 6], []])
def test_training_on_fewer_than_two_concepts_is_refused(rows):
    with pytest.raises(InputError, match="training registrations: cover fewer than two concepts"):
        known_concepts(CONCEPT_N[rows])


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
    state = vars(question)
    require_trees(state, 6)
    loaded = BoostedQuestion(**state)
    assert loaded.probability(asked).tobytes() == question.probability(asked).tobytes()
    assert loaded.probability(asked[:1])[0] == question.probability(asked)[0]


def test_a_single_answer_needs_no_tree_and_few_samples_are_not_split(samples):
    inputs_N_F, yes_N = samples
    answers = {name: np.full(len(yes_N), name) for name in (False, True)}
    for answer, answer_N, n in ((False, answers[False], 200), (True, answers[True], 200), (None, yes_N, 10)):
        question = BoostedQuestion.fit(inputs_N_F[:n], answer_N[:n], "tiny", 0)
        require_trees(vars(question), 6)
        assert np.ptp(question.probability(inputs_N_F)) == 0
        assert answer in (None, question.probability(inputs_N_F)[0] > 0.5)
