"""The other groups: the protocol's own reading is what the protocol gives, and each choice does what it says."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.active_learning.retraining import Retraining, learn
from gpca.active_learning.rounds import make_task
from gpca.attribution.learner_predictions import read_learner_predictions
from gpca.attribution.predictions import write_predictions
from gpca.classifier.gpc import GPC
from gpca.classifier.scores import Attribution
from gpca.classifier.settings import GPCSettings
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.readings import labels, learners, subsets
from gpca.steps.readings.files import accuracies
from gpca.steps.readings.groups import ReadingSizes
from tests.steps.readings.conftest import SECTIONS, rows_of

PROTOCOL = {"inputs": "standardised", "inducing": "kmeans", "lengthscale": "median", "batch": "full"}


@pytest.fixture(scope="module")
def halves(embedded):
    return [embedded.subset(embedded.rows(split)) for split in ("train", "test")]


def test_the_protocols_start_is_the_classifiers_own_and_others_are_not(halves):
    train, test = halves
    settings = GPCSettings(**SECTIONS["gpca_paper"])
    expected = GPC(CONCEPTS, settings, "tiny", 0).fit(train.embedding, train.concept).attribute(test.embedding)[0]

    def scores(**choice):
        gpc = learners.StartedGPC(settings, PROTOCOL | choice, "tiny", 0)
        return gpc.fit(train.embedding, train.concept).attribute(test.embedding)[0]

    np.testing.assert_array_equal(scores(), expected)
    for choice in (
        *({"inputs": inputs} for inputs in ("raw", "unit_norm")),
        *({"inducing": "random"}, {"lengthscale": "default"}, {"batch": "minibatch"}),
    ):
        assert np.abs(scores(**choice) - expected).max() > 1e-3
    np.testing.assert_allclose(np.linalg.norm(learners.to_unit_norm(test.embedding), axis=1), 1, rtol=1e-5)
    assert not learners.to_unit_norm(np.zeros((1, 3))).any()


def test_starts_touch_the_small_rate_and_table_v(run_files):
    settings = SECTIONS | {"gpca_paper": SECTIONS["gpca_paper"] | {"inducing": 4}}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(learners, "FITTED", (("polynomial", 0.001, 2), ("rbf", 0.01, 2), ("matern32", 0.01, 2)))
        patch.setattr(learners, "SHOWN_AS", {("rbf", 0.01, 2): "gpca_paper", ("matern32", 0.01, 2): "gpca_matern"})
        found = rows_of(learners.starts, replace(run_files, settings=settings), {k: [v] for k, v in PROTOCOL.items()})
    methods = {(method, metric) for _, method, metric, concept in found if concept == "all"}
    assert {("polynomial-0.001-2", "accuracy"), ("gpca_paper", "accuracy"), ("gpca_matern", "ece")} <= methods


def test_kernel_and_schedule_of_table_v(run_files):
    found = rows_of(learners.kernel, run_files, {"kernel": ["rbf", "matern32"], "iterations": [1, 20]})
    ece = {reading: v for (reading, _, metric, concept), v in found.items() if (metric, concept) == ("ece", "all")}
    assert set(ece) == {("rbf", 1), ("rbf", 20), ("matern32", 1), ("matern32", 20)}
    assert ece["rbf", 1] != ece["rbf", 20] != ece["matern32", 20]
    assert {method for _, method, _, _ in found} == {"gpca_matern"}


def test_the_protocols_svm_is_the_learners_own_and_probabilities_add_up(halves):
    train, test = halves
    learner = explainer_entry(learners.SVM).make("tiny", 0)
    learner.fit(train)
    own = learners.svm_scores(train, test.embedding, "svc", "standardised", "platt")
    np.testing.assert_allclose(own, learner.explain(test).scores_N_C)
    softmax = learners.svm_scores(train, test.embedding, "linear_svc", "raw", "softmax")
    np.testing.assert_allclose(softmax.sum(axis=1), 1)
    assert accuracies(test.concept, softmax)["accuracy", "all"] > 0.8


def test_another_head_trains_another_encoder_and_only_where_it_is_wanted(run_files):
    choices = {"head": ["linear", "two_layer"], "inputs": ["standardised"]}
    found = rows_of(learners.encoder_head, run_files, choices)
    methods = {(reading[0], method) for reading, method, _, _ in found}
    learned = ("gpca_paper", "gpca_matern", "learner_forest", "learner_linear_svm")
    assert methods == {(h, m) for h in choices["head"] for m in learned}
    none = rows_of(learners.encoder_head, replace(run_files, sizes=ReadingSizes(encoders=0)), choices)
    assert {reading[0] for reading, *_ in none} == {"linear"}


def test_diagnostics_follow_set_score_and_area(run_files, halves, tmp_path):
    from gpca.io.csv_file import write_csv
    from gpca.pairs.shifted_sets import ShiftedSets
    from gpca.steps.shift import predict_sets

    path = tmp_path / "tiny/learner_linear_svm/seed0.csv"
    path.parent.mkdir(parents=True)
    write_csv(
        path,
        predict_sets(
            lambda: explainer_entry(learners.SVM).make("tiny", 0), ShiftedSets.load(run_files.sets["tiny", 0])
        ),
    )
    [rows] = read_learner_predictions([path], run_files.sets.values()).values()
    reading = {"set": "in_distribution", "distance": "knn_embedding", "score": "bald", "area": "aurc"}
    one = learners.diagnostics_under(rows, reading)
    assert one == learners.diagnostics_under(rows, reading | {"score": "entropy"})  # it has no BALD
    wrong = rows.assign(
        concept_predicted=["noise"] * len(rows), entropy=(rows["concept_true"] != "noise").astype(float)
    )
    assert learners.diagnostics_under(wrong, reading | {"area": "auroc_error"})["aurc_max_score", "all"] == 0
    right = rows.assign(concept_predicted=rows["concept_true"])
    assert ("aurc_max_score", "all") not in learners.diagnostics_under(right, reading | {"area": "auroc_error"})


def test_severities_come_in_thirds_of_each_concept(run_files, halves):
    _, test = halves
    part_S = subsets.third_S(test)
    for concept in CONCEPTS:
        names, counts = np.unique(part_S[test.concept == concept], return_counts=True)
        assert dict(zip(names, counts, strict=True)) == {"weakest": 2, "middle": 2, "strongest": 2}
    crop_S = test.severity_crop
    overlap = test.concept == "overlap"
    assert crop_S[overlap & (part_S == "weakest")].max() < crop_S[overlap & (part_S == "strongest")].min()
    found = rows_of(subsets.thirds, run_files, {"part": ["all", "weakest"], "classifier": ["paper", "converged"]})
    assert found[("all", "paper"), "gpca_paper", "accuracy", "all"] == pytest.approx(15 / 18)
    assert {reading[1] for reading, *_ in found} == {"paper"}  # there are no predictions of the other


def test_pool_holds_the_share_and_labels_are_counted_to_the_target(run_files):
    found = rows_of(labels.pool, run_files, {"new_share": [0.1, 0.4], "batch": [1, 2], "initial": [8, 400]})
    kinds = {(reading, method, metric) for reading, method, metric, _ in found}
    assert ((0.1, 1, 8), "random", "labels_to_target") in kinds
    assert not [reading for reading, *_ in kinds if reading[2] == 400]  # there are not so many
    assert found[(0.1, 1, 8), "random", "reached", "overlap"] in (0, 1)
    same = [found[(0.4, batch, 8), "random", "labels_to_target", "overlap"] for batch in (1, 2)]
    assert same[0] == same[1]


def test_epochs_fall_with_the_rate(run_files, monkeypatch):
    monkeypatch.setattr(labels, "EVERY", 5)
    monkeypatch.setattr(labels, "MOST", 50)
    within_reach = SECTIONS["active_learning"] | {"target": 0.5}
    run_files = replace(run_files, settings=SECTIONS | {"active_learning": within_reach})
    found = rows_of(labels.epochs, run_files, {"learning_rate": [0.001, 0.3], "labels": ["at_target", "all"]})
    slow, fast = (found[(rate, "all"), "bald_kmeans", "epochs_at_target", "overlap"] for rate in (0.001, 0.3))
    assert fast < slow <= labels.MOST


def saved_as(registrations, axes, folder):
    """The path of the same registrations as if they were of this source and seed."""
    path = folder / f"registrations/{axes[0]}/seed{axes[1]}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    replace(registrations, axes=axes).save(path)
    return path


def test_repeats_on_frames_vary_in_what_they_say(run_files, embedded, tmp_path):
    five = {("tiny", seed): saved_as(embedded, ("tiny", seed), tmp_path) for seed in range(3)}
    predictions = {("tiny", "dgcnn-none", seed): run_files.predictions["tiny", "gpca_paper", 0] for seed in range(3)}
    shown = replace(run_files, registrations=five, predictions=predictions)
    readings = [{"repeats": repeats, "objects": "all"} for repeats in ("everything", "classifiers", "samples")]
    rows = list(subsets.repeats(shown, readings))
    # A job for each kind of repeat gives the same.
    assert [row for reading in readings for row in subsets.repeats(shown, [reading])] == rows
    assert [row[3] for row in rows] == [0, 1, 2] * 3
    assert {row[4]["accuracy", "all"] for row in rows[:3]} == {15 / 18}


def test_the_cold_classifier_of_the_labels_is_the_protocols(run_files):
    choices = {"learning_rate": [0.1], "iterations": [20], "start": ["cold", "warm"], "inputs": ["labeled", "pool"]}
    found = rows_of(labels.classifiers, run_files, choices)
    base, rare, target = labels.label_settings(run_files)
    [(source, seed, registrations, _)] = run_files.in_distribution()
    axes = source, seed, labels.JUDGED
    task = make_task(registrations, labels.NEW, base, source, seed, new_share=labels.JUDGED_SHARE)
    learned = learn(Retraining(task, rare.gpc, *axes), "bald_kmeans", rare, [target], *axes)
    of_cold = found[(0.1, 20, "cold", "labeled"), "bald_kmeans", "labels_to_target", "overlap"]
    assert of_cold == len(learned.labels_to(target))
    assert {(reading, metric) for reading, _, metric, _ in found} == {
        ((0.1, 20, start, inputs), metric)
        for start in choices["start"]
        for inputs in choices["inputs"]
        for metric in ("labels_to_target", "epochs_at_target", "reached")
    }


OBJECTS = ["all", "seen", "unseen"]
FRAMES = {"source": "tiny", "methods": ["dgcnn-none", "pointnext-none"], "estimated": "tiny_estimated"}


@pytest.fixture
def frame_files(run_files, embedded, tmp_path):
    """A wide DGCNN that names every sample rightly, and what DGCNN names from estimators' poses: noise for all."""
    moved = replace(embedded, axes=("tiny_estimated", 0))
    paths = {name: tmp_path / f"{name}.csv" for name in ("wide", "estimated")}
    scores_S_3 = 0.8 * (embedded.concept[:, None] == CONCEPTS) + 0.1
    write_predictions(paths["wide"], embedded, Attribution.of_scores(CONCEPTS, scores_S_3, seconds=0.0))
    scores_S_3[:] = [0.8, 0.1, 0.1]
    write_predictions(paths["estimated"], moved, Attribution.of_scores(CONCEPTS, scores_S_3, seconds=0.0))
    moved.save(tmp_path / "estimated.npz")
    judged = run_files.predictions["tiny", "gpca_paper", 0]  # right but for the first of each concept
    return replace(
        run_files,
        registrations=run_files.registrations | {("tiny_estimated", 0): tmp_path / "estimated.npz"},
        predictions={
            ("tiny", "dgcnn-none", 0): judged,
            ("tiny", "pointnext-none", 0): judged,
            ("tiny", "wide-none", 0): paths["wide"],
            ("tiny_estimated", "dgcnn-none", 0): paths["estimated"],
        },
        settings={"frames": FRAMES, "published": {"dgcnn": "wide"}},
    )


def over_all(found):
    return {key[:2]: value for key, value in found.items() if key[2:] == ("accuracy", "all")}


def test_an_encoder_as_published_stands_in_the_place_of_the_judged_one(frame_files):
    found = over_all(
        rows_of(subsets.other_rows, frame_files, {"architecture": ["judged", "published"], "objects": OBJECTS})
    )
    assert found[("judged", "all"), "dgcnn-none"] == pytest.approx(15 / 18)
    assert found[("published", "all"), "dgcnn-none"] == 1
    assert (("published", "all"), "pointnext-none") not in found  # it has none
    assert {reading[1] for reading, _ in found} == {"all", "seen"}  # training saw every object


def test_the_same_rows_from_estimators_poses(frame_files):
    choices = {"initial_pose": ["true_pose", "estimated"], "objects": ["all"]}
    found = over_all(rows_of(subsets.other_rows, frame_files, choices))
    assert found[("true_pose", "all"), "dgcnn-none"] == pytest.approx(15 / 18)
    assert found[("estimated", "all"), "dgcnn-none"] == pytest.approx(1 / 3)
    assert found[("true_pose", "all"), "pointnext-none"] == pytest.approx(15 / 18)
    assert (("estimated", "all"), "pointnext-none") not in found  # the run lacks it
