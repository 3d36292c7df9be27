"""What all explainers of causes have in common, and what each of them has to itself."""

from dataclasses import replace

import numpy as np
import pytest

from baselines.gates import NominalThreshold
from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import HIDDEN, LABELS, labeled
from gpca.causes.descriptors import COLUMNS, EVERYTHING, WIDTHS, describe_all
from gpca.causes.settings import GROUPS, DescriptorSettings
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.errors import InputError
from gpca.explainers.registry import CAUSES, explainer_entry, explainer_module, explainers
from gpca.reenactment.dataset import FEATURES

GPC = {"learning_rate": 0.1, "iterations": 60, "inducing": 8, "draws": 50}
FAST = {
    **dict.fromkeys(("gpca", "gpca_pair", "gpca_further"), GPC),
    "gpca_pair_dgcnn": {"iterations": 20, "inducing": 8, "draws": 50, "points": 32, "draw_points": 16, "epochs": 1},
    "pair_forest": {"trees": 10},
    "pair_boosting": {"iterations": 3},
}
FAST |= {name: FAST["gpca"] for name in explainers(CAUSES) if name.startswith("gpca_on_")}
FAST |= {name: FAST["pair_forest"] for name in explainers(CAUSES) if name.startswith("trees_on_")}
FAST |= {f"{name}_clouds": settings for name, settings in FAST.items()}
# Each is made of three of the others, and slow.
COMMITTEES = {"committee_further", "pair_committee", "pair_committee_clouds", "reenact_committee"}
NAMES = sorted(set(explainers(CAUSES)) - COMMITTEES)


@pytest.fixture(scope="module")
def seen(causes):
    """Registrations with labels, descriptors and an embedding that tells the labels apart."""
    registrations = labeled(causes)
    few = DescriptorSettings(starts=1, restarts=2, icp_points=64)
    descriptors, _, _ = describe_all(causes, "four", 100, few, ICPSettings())
    embedding = np.random.default_rng(0).normal(size=(len(causes), 6))
    for i, label in enumerate(LABELS):
        embedding[registrations.concept == label, i] += 3
    read = {"embedding": embedding, "head_logits": embedding[:, :4], **descriptors.groups}
    exponentials = np.exp(embedding[:, :4])
    read |= {
        "verdict": exponentials / exponentials.sum(axis=1, keepdims=True),
        "reenactment": embedding[:, np.arange(len(FEATURES)) % 6],
    }
    off = np.column_stack([causes.error_shown, np.full(len(causes), 0.2)])  # were the truth or a pose far off true
    read |= {"result_error": off, "weight": np.tile([0.7, 0.3], (len(causes), 1))}
    registrations = replace(registrations, attached={**registrations.attached, **read})
    return registrations.subset(np.flatnonzero(registrations.concept != BORDERLINE))


def explained(name, registrations):
    explainer = explainer_entry(name, CAUSES).make("four", 100, **FAST.get(name, {}))
    explainer.fit(registrations)
    return explainer.explain(registrations.without_labels())


@pytest.mark.parametrize("name", NAMES)
def test_scores_are_over_the_labels_and_depend_on_nothing_but_what_the_entry_says_it_sees(name, seen):
    entry, first = explainer_entry(name, CAUSES), explained(name, seen)
    assert first.concepts == LABELS
    assert first.scores_N_C.shape == (len(seen), 4)
    assert ((first.scores_N_C >= 0) & (first.scores_N_C <= 1)).all()
    assert first.abstained_N.all() == name.startswith(("gate_", "alarm_", "result"))
    if name in ("gpca", "softmax_head", "concept_vectors", "pair_forest", "gpca_pair"):  # it learned these samples
        assert (first.predicted_N == seen.concept).mean() > 0.5
    blind = {array: np.full_like(numbers, 7.0) for array, numbers in seen.attached.items()}
    blind |= {array: seen.attached[array] for array in HIDDEN}
    for group, columns in (shown for part in entry.sees for shown in COLUMNS.get(part, {}).items()):
        blind[group][:, columns] = seen.attached[group][:, columns]
    if "reenactment" in entry.sees:
        blind |= {array: seen.attached[array] for array in ("verdict", "reenactment", "result_error", "weight")}
    if entry.reads == "embeddings":
        blind |= {array: seen.attached[array] for array in ("embedding", "head_logits")}
    assert np.array_equal(explained(name, replace(seen, attached=blind)).scores_N_C, first.scores_N_C)


def test_a_committee_says_the_mean_of_what_its_members_say(seen):
    from baselines.descriptors import Committee

    committee = Committee(EVERYTHING, ("pair", "motion", "runs", "remedies"), "four", 100)
    committee.fit(seen)
    members = [member.explain(seen).scores_N_C for member in committee._members]
    assert committee.explain(seen).scores_N_C == pytest.approx(np.mean(members, axis=0))


def test_what_is_untrained_says_what_the_re_enactment_says_and_a_committee_on_it_reads_its_numbers_alone(seen):
    assert np.array_equal(explained("reenact", seen).scores_N_C, seen.attached["verdict"])
    said = explained("reenact_committee", seen)
    assert (said.predicted_N == seen.concept).mean() > 0.5
    blind = {group: np.full_like(array, 7.0) for group, array in seen.attached.items()}
    blind["reenactment"] = seen.attached["reenactment"]
    again = explained("reenact_committee", replace(seen, attached=blind))
    assert np.array_equal(said.scores_N_C, again.scores_N_C)


def test_one_label_is_nothing_to_learn_but_for_an_alarm(seen):
    explainer = explainer_entry("alarm_entropies", CAUSES).make("four", 100)
    explainer.fit(seen.subset(np.flatnonzero(seen.concept != NOMINAL)))
    assert (explainer.explain(seen).scores_N_C[:, 0] == 0).all()
    alike = seen.subset(np.flatnonzero(seen.concept == NOMINAL))
    for name in ("pair_forest", "concept_vectors"):
        with pytest.raises(InputError, match="fewer than two"):
            explained(name, alike)


def test_the_threshold_of_nominal_is_the_best_and_holds_for_the_scores():
    alarm = np.array([0.1, 0.2, 0.3, 0.35, 0.9, 1.2])
    label = np.array([NOMINAL, NOMINAL, "pose", NOMINAL, "noise", "pose"])
    threshold = NominalThreshold().fit(alarm, label)
    shares = np.tile([0.2, 0.5, 0.3], (2, 1))
    scores = threshold.scores(np.array([0.34, 0.8]), shares)
    assert scores.sum(axis=1) == pytest.approx(1)
    assert scores.argmax(axis=1).tolist() == [0, 2]  # above 0.625 something is wrong
    assert NominalThreshold().fit(alarm, np.full(6, "pose"))._threshold == pytest.approx(np.median(alarm))


def test_a_gate_alarms_where_its_number_is_bad(seen):
    scores = explained("gate_rmse", seen).scores_N_C[:, 0]
    rmse = seen.attached["motion"][:, 4]
    order = np.argsort(rmse, kind="stable")
    assert (np.diff(scores[order]) <= 1e-12).all()
    fitness = explained("gate_fitness", seen).scores_N_C[:, 0]
    assert (np.diff(fitness[np.argsort(seen.attached["motion"][:, 3], kind="stable")]) >= -1e-12).all()


def test_the_judge_of_the_result_ranks_by_the_error_that_is_shown_and_learns_from_nothing_else(seen):
    said = 1 - explained("result", seen).scores_N_C[:, 0]
    off = seen.attached["error_shown"] > 0.03
    assert off.any() and not off.all()
    assert said[off].min() > said[~off].max()
    other = replace(seen, concept=np.roll(seen.concept, 1))
    assert np.array_equal(1 - explained("result", other).scores_N_C[:, 0], said)


def test_every_kind_of_explainer_has_its_own_names():
    assert explainer_module("gpca", CAUSES) == "baselines.aligned_source"
    assert explainer_module("gpca") == "gpca.explainers.gpca"
    with pytest.raises(InputError, match="explainer 'shap_oracle': unknown; choose one of"):
        explainer_entry("shap_oracle", CAUSES)


@pytest.fixture(scope="module")
def told(causes):
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
def test_who_learns_tells_the_failed_from_the_nominal_and_names_no_cause(name, told):
    said, failed = explained(name, told), told.concept != NOMINAL
    alarm = 1 - said.scores_N_C[:, 0]
    assert alarm[failed].mean() > alarm[~failed].mean() + 0.3
    assert said.abstained_N.all() and said.scores_N_C.sum(axis=1) == pytest.approx(1)
    assert np.ptp(said.scores_N_C[:, 1:], axis=1).max() == 0


@pytest.mark.parametrize("gate", ["gate_censi", "gate_brossard"])
def test_a_pose_that_hardly_anything_holds_raises_the_gate_of_the_covariance(gate, told):
    random = np.random.default_rng(0)
    wall = np.column_stack([random.uniform(-0.5, 0.5, (200, 2)), 0.01 * random.normal(size=200)])
    corner = np.concatenate([wall, wall[:, [2, 0, 1]], wall[:, [1, 2, 0]]])[::3]
    few = told.subset(np.arange(2))
    clouds = [(wall * 0.01).astype(np.float32), corner.astype(np.float32)]
    ends = np.cumsum([0, *map(len, clouds)])
    points = np.concatenate([cloud + np.float32(0.005) for cloud in clouds])
    few = replace(few, points=points, offsets=ends, target_points=np.concatenate(clouds), target_offsets=ends)
    few = replace(few, fitness=np.ones(2))
    alarm = 1 - explained(gate, few).scores_N_C[:, 0]
    assert alarm[0] > alarm[1]
