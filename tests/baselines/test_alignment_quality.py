"""Classifiers and a gate that say whether clouds are aligned, and name no cause."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.dataset import labeled
from gpca.causes.descriptors import WIDTHS
from gpca.causes.settings import GROUPS
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.explainers.registry import CAUSES, explainer_entry


@pytest.fixture(scope="module")
def seen(causes):
    """Labeled registrations; one entropy of the joint clouds, and a distance, tell the failed from the others."""
    registrations = labeled(causes)
    random = np.random.default_rng(0)
    groups = {name: random.normal(size=(len(registrations), WIDTHS[name])) for name in GROUPS}
    failed = registrations.concept != NOMINAL
    groups["entropy"][:, 0] += 4 * failed
    groups["distances"][:, 3] += 4 * failed
    registrations = replace(registrations, attached={**registrations.attached, **groups})
    return registrations.subset(np.flatnonzero(registrations.concept != BORDERLINE))


@pytest.mark.parametrize("name", ["alarm_entropies", "alarm_features"])
def test_who_learns_tells_the_failed_from_the_nominal_and_names_no_cause(name, seen):
    explainer = explainer_entry(name, CAUSES).make("four", 100)
    explainer.fit(seen)
    said = explainer.explain(seen)
    failed = seen.concept != NOMINAL
    alarm = 1 - said.scores_N_C[:, 0]
    assert alarm[failed].mean() > alarm[~failed].mean() + 0.3
    assert said.abstained_N.all() and said.scores_N_C.sum(axis=1) == pytest.approx(1)
    assert np.ptp(said.scores_N_C[:, 1:], axis=1).max() == 0


def test_where_all_failed_that_is_the_answer_for_all(seen):
    explainer = explainer_entry("alarm_entropies", CAUSES).make("four", 100)
    explainer.fit(seen.subset(np.flatnonzero(seen.concept != NOMINAL)))
    assert (explainer.explain(seen).scores_N_C[:, 0] == 0).all()


@pytest.mark.parametrize("gate", ["gate_censi", "gate_brossard"])
def test_a_pose_that_hardly_anything_holds_raises_the_gate_of_the_covariance(gate, seen):
    random = np.random.default_rng(0)
    wall = np.column_stack([random.uniform(-0.5, 0.5, (200, 2)), 0.01 * random.normal(size=200)])
    corner = np.concatenate([wall, wall[:, [2, 0, 1]], wall[:, [1, 2, 0]]])[::3]
    few = seen.subset(np.arange(2))
    clouds = [(wall * 0.01).astype(np.float32), corner.astype(np.float32)]
    ends = np.cumsum([0, *map(len, clouds)])
    points = np.concatenate([cloud + np.float32(0.005) for cloud in clouds])
    few = replace(few, points=points, offsets=ends, target_points=np.concatenate(clouds), target_offsets=ends)
    few = replace(few, fitness=np.ones(2))
    gate = explainer_entry(gate, CAUSES).make("four", 100)
    gate.fit(few)
    alarm = 1 - gate.explain(few).scores_N_C[:, 0]
    assert alarm[0] > alarm[1]
