import dataclasses

import numpy as np
import pytest

from baselines import dirichlet_gp, heads, learners
from baselines.dirichlet_gp import JITTER, DirichletGP
from baselines.heads import Dropout, Ensemble
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS

# With a class for every concept, variances and BALD.
DRAWING = {**heads.EXPLAINERS, **dirichlet_gp.EXPLAINERS}
EXPLAINERS = {**learners.EXPLAINERS, **DRAWING}
FEW_STEPS = {  # for what is true of a head however long it was trained
    "learner_ensemble": {"members": 2, "steps": 30},
    "learner_dropout": {"steps": 30},
}


@pytest.fixture(scope="module")
def embedded(registrations):
    """The registrations, with an embedding of 12 dimensions that tells their concepts apart."""
    random = np.random.default_rng(0)
    concept_S = [CONCEPTS.index(concept) for concept in registrations.concept]
    embedding = 2.5 * random.normal(size=(3, 12))[concept_S] + random.normal(size=(len(registrations), 12))
    return dataclasses.replace(registrations, attached={"embedding": embedding})


def explained(name, embedded, train=None, source="tiny", seed=0, settings=None):
    learner = EXPLAINERS[name].make(source, seed, **(settings or {}).get(name, {}))
    learner.fit(embedded.subset(embedded.rows("train") if train is None else train))
    return learner.explain(embedded.subset(embedded.rows("test")).without_labels())


@pytest.mark.parametrize("name", EXPLAINERS)
def test_separated_concepts_are_told_apart_with_probabilities(name, embedded):
    attribution = explained(name, embedded)
    assert np.mean(attribution.predicted_N == embedded.concept[embedded.rows("test")]) > 0.9
    assert attribution.scores_N_C.sum(axis=1) == pytest.approx(1)
    assert attribution.scores_N_C.min() >= 0
    assert (attribution.icp_calls_N == 0).all()
    if name in DRAWING:
        assert 0 <= attribution.variances_N_C.min() < attribution.variances_N_C.max() <= 0.25
        assert -1e-6 < attribution.bald_N.min() < attribution.bald_N.max() <= np.log(3)


@pytest.mark.parametrize("name", learners.EXPLAINERS)
def test_a_concept_absent_from_training_keeps_its_column(name, embedded):
    train = embedded.rows("train")
    scores = explained(name, embedded, train[embedded.concept[train] != "pose"]).scores_N_C
    assert (scores[:, CONCEPTS.index("pose")] == 0).all()
    assert scores.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize("name", EXPLAINERS)
def test_scale_and_offset_of_the_embedding_do_not_matter_and_a_constant_one_gives_finite_scores(name, embedded):
    embeddings = (embedded.embedding, 50 + 1000 * embedded.embedding, np.ones((len(embedded), 12)))
    usual, moved, constant = (
        explained(name, dataclasses.replace(embedded, attached={"embedding": h}), settings=FEW_STEPS).scores_N_C
        for h in embeddings
    )
    assert np.abs(usual - moved).max() < 1e-3
    assert np.isfinite(constant).all()


@pytest.mark.parametrize("name", DRAWING)
def test_a_seed_repeats_every_byte_another_does_not_and_nothing_global_is_drawn(name, embedded):
    import torch

    before = torch.random.get_rng_state()
    first, again, other = (explained(name, embedded, seed=seed, settings=FEW_STEPS).scores_N_C for seed in (0, 0, 1))
    assert first.tobytes() == again.tobytes() != other.tobytes()
    assert torch.equal(torch.random.get_rng_state(), before)


@pytest.mark.parametrize("name", DRAWING)
def test_a_result_does_not_depend_on_the_other_samples(name, embedded):
    learner = EXPLAINERS[name].make("tiny", 0)
    learner.fit(embedded.subset(embedded.rows("train")))
    rows = embedded.rows("test")
    whole, part = (learner.explain(embedded.subset(chosen)).scores_N_C for chosen in (rows, rows[2:5]))
    assert np.abs(whole[2:5] - part).max() < 1e-5


@pytest.mark.parametrize("name", EXPLAINERS)
def test_fewer_than_two_concepts_are_a_fault_and_a_missing_embedding_is_named(name, embedded):
    train = embedded.rows("train")
    with pytest.raises(InputError, match="fewer than two concepts"):
        explained(name, embedded, train[embedded.concept[train] == "pose"])
    with pytest.raises(InputError, match="array 'embedding': is not attached"):
        explained(name, dataclasses.replace(embedded, attached={}))


def test_few_samples_of_a_concept_are_enough_for_an_svm_but_not_one_nor_fewer_than_neighbors(embedded):
    name = "learner_linear_svm"
    train, few = embedded.rows("train"), []
    with pytest.raises(InputError, match="learner_nearest: 37 neighbors are too many for 36 training samples"):
        explained("learner_nearest", embedded, settings={"learner_nearest": {"neighbours": len(train) + 1}})
    for concept in CONCEPTS:
        few += train[embedded.concept[train] == concept][:3].tolist()
    assert np.isfinite(explained(name, embedded, np.array(few)).scores_N_C).all()
    with pytest.raises(InputError, match="have a single sample of a concept; give at least two"):
        explained(name, embedded, np.array(few[:7]))


def exact_gp(embedded, **settings):
    learner = DirichletGP("tiny", 0, **settings)
    learner.fit(embedded.subset(embedded.rows("train")))
    return learner


def test_the_posterior_is_the_textbooks(embedded):
    """Mean m + k (K + S)^-1 (y - m) and variance k(x, x) - k (K + S)^-1 k, targets and noise from Milios et al."""
    learner, alpha = exact_gp(embedded, iterations=3, alpha=0.1), 0.1
    train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
    scale, length = np.exp(learner._log_scale_C.detach().numpy()), np.exp(learner._log_lengthscale_C.detach().numpy())
    x, z = (learner._scaler.transform(part.embedding) for part in (train, test))
    squares = {name: ((a[:, None] - b) ** 2).sum(axis=2) for name, a, b in (("xx", x, x), ("zx", z, x))}
    mean_N_C, deviation_N_C = learner._posterior(test)
    for c, concept in enumerate(CONCEPTS):
        concentration = alpha + (train.concept == concept)
        noise = np.log(1 / concentration + 1)
        y = np.log(concentration) - noise / 2
        K = scale[c] * np.exp(-squares["xx"] / (2 * length[c] ** 2)) + np.diag(noise + JITTER)
        k = scale[c] * np.exp(-squares["zx"] / (2 * length[c] ** 2))
        m = learner._mean_C[c].item()
        assert mean_N_C[:, c] == pytest.approx(m + k @ np.linalg.solve(K, y - m), abs=1e-5)
        variance = scale[c] - np.einsum("nt,tn->n", k, np.linalg.solve(K, k.T))
        assert deviation_N_C[:, c] ** 2 == pytest.approx(variance, abs=1e-5)


RANDOM = np.random.default_rng(0)
TARGETS = np.arange(60) % 3
H = 2 * RANDOM.normal(size=(3, 8))[TARGETS] + RANDOM.normal(size=(60, 8))


def direct(learner, h):
    """Draw the logits without registrations around them."""
    learner._heads.fit(H, TARGETS)
    return learner._draw_logits(h)


def test_an_ensemble_has_a_draw_per_member_and_dropout_one_per_pass():
    assert direct(Ensemble("a", 0, members=4, hidden=8), H[:5]).shape == (4, 5, 3)
    assert direct(Dropout("a", 0, passes=7, hidden=8), H[:5]).shape == (7, 5, 3)
