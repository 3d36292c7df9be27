"""Encoders of the pair, for concepts and for registrations with measured causes."""

from dataclasses import replace

import numpy as np
import pytest

from baselines.learned_pair import EXPLAINERS
from gpca.causes.dataset import LABELS, labeled
from gpca.causes.descriptors import WIDTHS
from gpca.causes.settings import DescriptorSettings
from gpca.causes.truth import BORDERLINE
from gpca.explainers.interface import icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry
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


NAMES = ("gpca_pair_dgcnn", "gpca_pair_dgcnn_clouds")
TINY = {"points": 48, "draw_points": 24, "epochs": 6, "learning_rate": 0.1, "iterations": 100, "inducing": 16}


@pytest.fixture(scope="module")
def pairs(causes):
    """Registrations with a label, with made-up numbers of motion and runs that give the label away."""
    registrations, random = labeled(causes), np.random.default_rng(0)
    registrations = registrations.subset(np.flatnonzero(registrations.concept != BORDERLINE))
    numbers = {group: random.normal(size=(len(registrations), WIDTHS[group])) for group in ("motion", "starts")}
    label_N = np.array([LABELS.index(concept) for concept in registrations.concept])
    for numbers_N_F in numbers.values():
        numbers_N_F += 4 * label_N[:, None]
    return replace(registrations, attached={**registrations.attached, **numbers})


def taught(name, pairs):
    explainer = explainer_entry(name, CAUSES).make("four", 100, **TINY, draws=50)
    explainer.fit(pairs)
    return explainer


@pytest.fixture(scope="module")
def explainers(pairs):
    return {name: taught(name, pairs) for name in NAMES}


def scores(explainer, pairs):
    return explainer.explain(pairs.without_labels()).scores_N_C


def test_what_the_runs_tell_is_learned_beside_the_clouds(explainers, pairs):
    entries = [explainer_entry(name, CAUSES) for name in NAMES]
    assert [entry.sight for entry in entries] == ["pair + motion + further runs", "pair"]
    assert [icp_calls(entry.sees, 13, DescriptorSettings()) for entry in entries] == [12, 0]
    found = explainers["gpca_pair_dgcnn"].explain(pairs.without_labels())
    assert found.concepts == LABELS
    assert (found.predicted_N == pairs.concept).mean() > 0.5


@pytest.mark.parametrize("name", NAMES)
def test_both_clouds_are_seen_and_not_where_icp_started(explainers, pairs, name):
    found = scores(explainers[name], pairs)
    off = pairs.T_target_source_init.copy()
    off[:, :3, 3] += 0.1
    assert np.array_equal(scores(explainers[name], replace(pairs, T_target_source_init=off)), found)
    for cloud in ("points", "target_points"):
        moved = replace(pairs, **{cloud: getattr(pairs, cloud) + np.float32(0.2)})
        assert not np.allclose(scores(explainers[name], moved), found)


def test_every_pair_that_it_is_given_teaches_it_whatever_its_split(pairs):
    as_test = replace(pairs, split=np.full(len(pairs), "test"), sample=np.arange(len(pairs)))
    assert scores(taught("gpca_pair_dgcnn_clouds", as_test), as_test).shape == (len(pairs), len(LABELS))
