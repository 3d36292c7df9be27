from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from baselines.aligned_source import ConceptVectors
from gpca.errors import InputError
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS


@pytest.fixture(scope="module")
def embedded(registrations):
    """Registrations whose embedding tells the concept, on axes of very different scale."""
    random = np.random.default_rng(0)
    concept_S = np.array([CONCEPTS.index(concept) for concept in registrations.concept])
    h = 2 * random.normal(size=(3, 6))[concept_S] + random.normal(size=(len(concept_S), 6))
    return replace(registrations, attached={"embedding": h * 10.0 ** np.arange(-2, 4)})


def fitted(registrations, **settings):
    explainer = explainer_entry("concept_vectors").make("tiny", 0, **settings)
    explainer.fit(registrations.subset(registrations.rows("train")))
    return explainer


def test_the_vectors_and_the_order_of_the_scores_equal_an_independent_computation(embedded):
    explainer = fitted(embedded, inverse_regularisation=0.5)
    train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
    mean, deviation = train.embedding.mean(axis=0), train.embedding.std(axis=0)
    scaled = (train.embedding - mean) / deviation
    positions = []
    for concept, vector in zip(CONCEPTS, explainer.vectors_K_d, strict=True):
        sign = np.where(train.concept == concept, 1, -1)

        def loss(w_b, sign=sign):
            return 0.5 * w_b[:-1] @ w_b[:-1] + 0.5 * np.logaddexp(0, -sign * (scaled @ w_b[:-1] + w_b[-1])).sum()

        normal = minimize(loss, np.zeros(7), tol=1e-10).x[:-1]
        normal /= np.linalg.norm(normal)
        assert vector == pytest.approx(normal, abs=2e-3)
        projections = scaled @ normal
        positions.append(((test.embedding - mean) / deviation @ normal - projections.mean()) / projections.std())
    log_scores = np.log(explainer.explain(test).scores_N_C)
    positions = np.column_stack(positions)
    assert log_scores - log_scores[:, :1] == pytest.approx(positions - positions[:, :1], abs=0.02)


@pytest.mark.parametrize("absent", CONCEPTS)
def test_a_concept_absent_from_training_scores_0(embedded, absent):
    explainer = fitted(embedded.subset(np.flatnonzero(embedded.concept != absent)))
    attribution = explainer.explain(embedded)
    seen = embedded.concept != absent
    assert (attribution.scores_N_C[:, CONCEPTS.index(absent)] == 0).all()
    assert np.mean(attribution.predicted_N[seen] == embedded.concept[seen]) > 0.9


def test_an_embedding_that_tells_nothing_is_refused(embedded):
    train = embedded.subset(embedded.rows("train"))
    with pytest.raises(InputError, match="array 'embedding': is the same for all training registrations"):
        ConceptVectors("tiny", 0).fit(replace(train, attached={"embedding": np.ones((36, 4))}))


def test_scores_are_the_softmax_of_the_logits_even_of_large_ones(registrations):
    logits = np.random.default_rng(0).normal(scale=3, size=(len(registrations), 3))
    logits[0] = [1000.0, 1000.0, 0.0]
    explainer = explainer_entry("softmax_head").make("tiny", 0)
    attribution = explainer.explain(replace(registrations, attached={"head_logits": logits}))
    weights = np.exp(logits[1:])
    assert attribution.scores_N_C[0] == pytest.approx([0.5, 0.5, 0.0])
    assert attribution.scores_N_C[1:] == pytest.approx(weights / weights.sum(axis=1, keepdims=True))
    assert attribution.predicted_N.tolist() == np.array(CONCEPTS)[logits.argmax(axis=1)].tolist()
    assert attribution.icp_calls_N.tolist() == [0] * len(registrations)
    assert (attribution.seconds_N > 0).all()


SETTINGS = {"iterations": 15, "inducing": 8, "draws": 100, "learning_rate": 0.05}


def test_gpytorchs_classes_say_what_gp_ca_says(registrations):
    h_S_6 = np.random.default_rng(0).normal(size=(len(registrations), 6)).astype(np.float32)
    h_S_6[:, :3] += 3 * (registrations.concept[:, None] == np.array(CONCEPTS))
    embedded = replace(registrations, attached={"embedding": h_S_6})
    train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
    ours, theirs = (explainer_entry(name).make("tiny", 0, **SETTINGS) for name in ("gpca_paper", "gpca_gpytorch"))
    with pytest.raises(InputError, match="3 samples for 3 classes"):
        theirs.fit(train.subset(np.arange(3)))
    for explainer in (ours, theirs):
        explainer.fit(train)
    ours, theirs = (explainer.explain(test.without_labels()) for explainer in (ours, theirs))
    assert theirs.predicted_N.tolist() == ours.predicted_N.tolist()
    assert np.mean(theirs.predicted_N == test.concept) > 0.6  # chance is a third
    for name in ("scores_N_C", "variances_N_C", "bald_N"):
        assert getattr(theirs, name) == pytest.approx(getattr(ours, name), abs=1e-4)
    assert not theirs.icp_calls_N.any()
    assert (theirs.seconds_N > 0).all()
