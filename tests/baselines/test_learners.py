import dataclasses

import numpy as np
import pytest

from baselines import dirichlet_gp, heads, learners
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS

# With a class for every concept, variances and BALD.
DRAWING = {**heads.EXPLAINERS, **dirichlet_gp.EXPLAINERS}
EXPLAINERS = {**learners.EXPLAINERS, **DRAWING}
FEW_STEPS = {  # for what is true of a head however long it was trained
    "learner_ensemble": {"members": 2, "steps": 30},
    "learner_dropout": {"steps": 30},
    "learner_laplace_head": {"steps": 30, "hidden": 16},
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


@pytest.mark.parametrize("name", learners.EXPLAINERS)
def test_a_concept_absent_from_training_keeps_its_column(name, embedded):
    train = embedded.rows("train")
    scores = explained(name, embedded, train[embedded.concept[train] != "pose"]).scores_N_C
    assert (scores[:, CONCEPTS.index("pose")] == 0).all()
    assert scores.sum(axis=1) == pytest.approx(1)


def test_more_neighbors_than_training_samples_are_refused(embedded):
    learner = learners.Nearest("tiny", 0, neighbours=len(embedded.rows("train")) + 1)
    with pytest.raises(InputError, match="learner_nearest: 37 neighbors are too many for 36 training samples"):
        learner.fit(embedded.subset(embedded.rows("train")))


@pytest.mark.parametrize("name", EXPLAINERS)
def test_scale_and_offset_of_the_embedding_do_not_matter(name, embedded):
    moved = dataclasses.replace(embedded, attached={"embedding": 50 + 1000 * embedded.embedding})
    usual, other = (explained(name, given, settings=FEW_STEPS).scores_N_C for given in (embedded, moved))
    assert np.abs(usual - other).max() < 1e-3


@pytest.mark.parametrize("name", EXPLAINERS)
def test_a_constant_embedding_gives_finite_scores(name, embedded):
    constant = dataclasses.replace(embedded, attached={"embedding": np.ones((len(embedded), 12))})
    assert np.isfinite(explained(name, constant, settings=FEW_STEPS).scores_N_C).all()


@pytest.mark.parametrize("name", learners.EXPLAINERS)
def test_the_same_embeddings_give_the_same_scores(name, embedded):
    assert np.array_equal(explained(name, embedded).scores_N_C, explained(name, embedded, seed=1).scores_N_C)


@pytest.mark.parametrize("name", DRAWING)
def test_a_concept_absent_from_training_is_hardly_ever_named(name, embedded):
    train = embedded.rows("train")
    scores = explained(name, embedded, train[embedded.concept[train] != "pose"]).scores_N_C
    assert scores[:, CONCEPTS.index("pose")].max() < 0.5
    assert scores.sum(axis=1) == pytest.approx(1)


@pytest.mark.parametrize("name", DRAWING)
def test_draws_give_variances_and_bald_in_their_bounds(name, embedded):
    attribution = explained(name, embedded)
    assert 0 <= attribution.variances_N_C.min() < attribution.variances_N_C.max() <= 0.25
    assert -1e-6 < attribution.bald_N.min() < attribution.bald_N.max() <= np.log(3)


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
def test_fewer_than_two_concepts_are_a_fault(name, embedded):
    train = embedded.rows("train")
    with pytest.raises(InputError, match="fewer than two concepts"):
        explained(name, embedded, train[embedded.concept[train] == "pose"])


@pytest.mark.parametrize("name", EXPLAINERS)
def test_a_missing_embedding_is_named(name, embedded):
    with pytest.raises(InputError, match="array 'embedding': is not attached"):
        explained(name, dataclasses.replace(embedded, attached={}))


@pytest.mark.parametrize("name", ["learner_linear_svm", "learner_rbf_svm"])
def test_few_samples_of_a_concept_are_enough_for_an_svm_but_not_one(name, embedded):
    train, few = embedded.rows("train"), []
    for concept in CONCEPTS:
        few += train[embedded.concept[train] == concept][:3].tolist()
    assert np.isfinite(explained(name, embedded, np.array(few)).scores_N_C).all()
    with pytest.raises(InputError, match="have a single sample of a concept; give at least two"):
        explained(name, embedded, np.array(few[:7]))
