"""An encoder of the pair that is learned from registrations with measured causes."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.dataset import LABELS, labeled
from gpca.causes.descriptors import WIDTHS
from gpca.causes.settings import DescriptorSettings
from gpca.causes.truth import BORDERLINE
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.explainers.sight import icp_calls

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


def test_it_says_what_it_reads_and_which_runs_that_costs():
    entries = [explainer_entry(name, CAUSES) for name in NAMES]
    assert [entry.sight for entry in entries] == ["pair + motion + further runs", "pair"]
    assert [icp_calls(entry.sees, 13, DescriptorSettings()) for entry in entries] == [12, 0]


def test_what_the_runs_tell_is_learned_beside_the_clouds(explainers, pairs):
    found = explainers["gpca_pair_dgcnn"].explain(pairs.without_labels())
    assert found.concepts == LABELS
    assert (found.predicted_N == pairs.concept).mean() > 0.6


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
