import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression

from gpca.errors import InputError
from gpca.explainers.concept_classifier import ConceptClassifier
from gpca.pairs.perturbation import CONCEPTS

CONCEPT_N = np.array(CONCEPTS)[np.arange(60) % 3]
CENTERS = np.array([[-3.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
X = CENTERS[np.arange(60) % 3] + np.random.default_rng(0).normal(size=(60, 2))


def test_columns_are_the_concepts_although_scikit_learn_sorts_them():
    scores = ConceptClassifier(LogisticRegression()).fit(X, CONCEPT_N).scores(CENTERS)
    assert np.array_equal(scores.argmax(axis=1), [0, 1, 2])
    assert scores.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize("absent", CONCEPTS)
def test_a_concept_absent_from_training_scores_0_and_the_others_keep_their_columns(absent):
    seen = absent != CONCEPT_N
    scores = ConceptClassifier(LogisticRegression()).fit(X[seen], CONCEPT_N[seen]).scores(CENTERS)
    assert (scores[:, CONCEPTS.index(absent)] == 0).all()
    others = [c for c in range(3) if CONCEPTS[c] != absent]
    assert scores.argmax(axis=1)[others].tolist() == others
    assert scores.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize("rows", [[0, 3, 6], []])
def test_training_on_fewer_than_two_concepts_is_refused(rows):
    with pytest.raises(InputError, match="training registrations: cover fewer than two concepts"):
        ConceptClassifier(LogisticRegression()).fit(X[rows], CONCEPT_N[rows])
