"""The values of the printed numbers of Tables I to V under joint readings, on samples of one source, seed and severity.

Each value is named by the part that it belongs to, under the choices that it depends on (see ``choices.py``), and by
method, metric and concept of its counterpart in published.csv.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from gpca.active_learning.rounds import LabelingTask, make_task, rounds
from gpca.active_learning.settings import LOOK_EVERY, ActiveLearningSettings
from gpca.attribution import diagnostics
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.evaluation.measures import ALL
from gpca.experiments.joint_reading.choices import SCHEDULES, SEVERITIES, START, Joint, part_name
from gpca.experiments.joint_reading.measured_samples import MeasureSettings, Subjects
from gpca.experiments.specification_curve.diagnostics import accuracies
from gpca.experiments.specification_curve.gpc_start import FITTED, StartedGPC, of_unit_norm, relevant
from gpca.experiments.specification_curve.knobs import accuracies_of_magnitudes, runs_of
from gpca.experiments.specification_curve.labels import NEW
from gpca.experiments.specification_curve.learners import FOREST, SVM, svm_scores
from gpca.experiments.specification_curve.run_files import like_the_training
from gpca.explainers.registry import explainer_entry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.shifted_sets import DISTANCES, ShiftedSets
from gpca.process.progress import progress
from gpca.uncertainty.interventions import MIDDLE, UPPER

LOWER = (0.01, 1.5, 0.20)  # the knobs at the lower ends of the severities
KNOBS = {"low": LOWER, "middle": MIDDLE, "high": UPPER}
PRINTED = (*FITTED, ("polynomial", 0.01, 200))  # kernel, rate and iterations of Table IV's rows
RANDOM_ROUND = 25  # random choice is the same in rounds of any size, and needs many labels
Value = tuple[str, str, str, str, float]  # part, method, metric, concept, value


def values(
    subjects: Subjects, severities: str, choices: Mapping[str, Sequence], settings: MeasureSettings
) -> Iterator[Value]:
    """Yield the values under every combination of these choices that matters to a part, with these severities."""
    choices = dict(choices) | {SEVERITIES: [severities]}
    yield from _of_knobs(subjects, choices, settings)
    yield from _of_learners(subjects, choices)
    starts = list(_combinations(choices, (SEVERITIES, *START)))
    known: dict[tuple, GPC] = {}
    for start in progress(starts, f"joint readings of {' '.join(map(str, subjects.axes))}, {severities}"):
        fitted = dict(_fitted(subjects, start, settings, known))
        test = subjects.split("test")
        for (kernel, rate, iterations), gpc in fitted.items():
            method = f"{kernel}-{rate:g}-{iterations}"
            right = accuracies(test.concept, gpc.attribute(test.embedding)[0])
            yield part_name("schedules", start), method, "accuracy", ALL, right["accuracy", ALL]
        for kernel in choices["kernel"]:
            joint = start | {"kernel": kernel}
            yield from _of_classifier(subjects, joint, choices, fitted[SCHEDULES[kernel]])
            yield from _of_labels(subjects, joint, choices, settings)


def _of_knobs(subjects: Subjects, choices: Mapping[str, Sequence], settings: MeasureSettings) -> Iterator[Value]:
    """Yield the accuracies of SHAP and SA by how far the knobs are turned."""
    uncertainty, title = settings.uncertainty, f"knobs of {subjects.axes[0]}, seed {subjects.axes[1]}"
    pairs = runs_of(subjects.pairs, *subjects.axes, uncertainty, uncertainty.starts, title)
    turned_R_3 = np.array([KNOBS[name] for name in choices["knobs"]])
    for method, value_R in accuracies_of_magnitudes(pairs, turned_R_3, uncertainty.floor).items():
        for joint, value in zip(_combinations(choices, (SEVERITIES, "knobs")), value_R, strict=True):
            yield part_name("knobs", joint), method, "accuracy", ALL, float(value)


def _fitted(
    subjects: Subjects, start: Joint, settings: MeasureSettings, known: dict[tuple, GPC]
) -> Iterator[tuple[tuple[str, float, int], GPC]]:
    """Yield the classifier of every row of Table IV from one start; `known` keeps those that starts share."""
    train = subjects.split("train")
    for schedule in PRINTED:
        key = (schedule, *relevant(start, schedule[0]).values())
        if key not in known:
            gpc = StartedGPC(gpc_settings(settings, schedule), start, *subjects.axes)
            known[key] = gpc.fit(train.embedding, train.concept)
        yield schedule, known[key]


def _of_classifier(subjects: Subjects, joint: Joint, choices: Mapping[str, Sequence], gpc: GPC) -> Iterator[Value]:
    """Yield the accuracies of GP-CA in Tables I and II and of the GPC in V, and the diagnostics of the latter."""
    test = subjects.split("test")
    scores_S_C = gpc.attribute(test.embedding)[0]
    for (metric, concept), value in accuracies(test.concept, scores_S_C).items():
        yield part_name("classifier", joint), "gpca_paper", metric, concept, value
    right = accuracies(test.concept, scores_S_C)["accuracy", ALL]
    yield part_name("classifier", joint), "gpca_matern", "accuracy", ALL, right
    scored = {name: (gpc.attribute(part.embedding)[0], part, rows) for name, part, rows in _test_sets(subjects)}
    for asked in _combinations(choices, ("set", "distance")):
        for metric, value in _diagnostics(scored, subjects.sets, asked).items():
            yield part_name("diagnostics", joint | asked), "gpca_matern", metric, ALL, value


def _of_learners(subjects: Subjects, choices: Mapping[str, Sequence]) -> Iterator[Value]:
    """Yield accuracies and diagnostics of the forest and the linear SVM, by the scale of their inputs."""
    for joint in _combinations(choices, (SEVERITIES, "inputs")):
        inputs = joint["inputs"]

        def seen(samples: Registrations, inputs: str = inputs) -> Registrations:
            h_S_d = of_unit_norm(samples.embedding) if inputs == "unit_norm" else samples.embedding
            return replace(samples, attached={"embedding": h_S_d})

        train = seen(subjects.split("train"))
        forest = explainer_entry(FOREST).make(*subjects.axes)
        forest.fit(train)
        parts = [(name, seen(part), rows) for name, part, rows in _test_sets(subjects)]
        scaled = "standardised" if inputs == "standardised" else "raw"
        asked_S_d = np.concatenate([part.embedding for _, part, _ in parts])
        ends = np.cumsum([len(part) for _, part, _ in parts])[:-1]
        of_svm = np.split(svm_scores(train, asked_S_d, "svc", scaled, "platt"), ends)
        scored_by = {
            FOREST: {name: (forest.explain(part).scores_N_C, part, rows) for name, part, rows in parts},
            SVM: {name: (scores_S_C, part, rows) for scores_S_C, (name, part, rows) in zip(of_svm, parts, strict=True)},
        }
        for method, scored in scored_by.items():
            scores_S_C, part, _ = scored["in_distribution"]
            right = accuracies(part.concept, scores_S_C)["accuracy", ALL]
            yield part_name("learners", joint), method, "accuracy", ALL, right
            for asked in _combinations(choices, ("set", "distance")):
                for metric, value in _diagnostics(scored, subjects.sets, asked).items():
                    yield part_name("learner_diagnostics", joint | asked), method, metric, ALL, value


def _test_sets(subjects: Subjects) -> Iterator[tuple[str, Registrations, np.ndarray]]:
    """Yield name, test samples and their rows of the sets whose samples are embedded by the encoder itself."""
    for name in ("in_distribution", "severity"):
        rows = subjects.sets.rows(name, "test")
        yield name, subjects.sets.registrations(rows), rows


def _diagnostics(
    scored: Mapping[str, tuple[np.ndarray, Registrations, np.ndarray]], sets: ShiftedSets, asked: Joint
) -> dict[str, float]:
    """Return ρ, AUC and ECE of the uncertainty 1 - max ŝ on the set and by the distance that are asked about."""
    parts = [scored[name] for name in asked["set"].split("+")]
    scores_S_C = np.concatenate([scores for scores, _, _ in parts])
    target_S = np.array([CONCEPTS.index(concept) for _, part, _ in parts for concept in part.concept])
    distance_S = sets.distance[np.concatenate([rows for _, _, rows in parts]), DISTANCES.index(asked["distance"])]
    confidence_S = scores_S_C.max(axis=1)
    return {
        "rho_max_score_knn_analytical": diagnostics.rank_correlation(1 - confidence_S, distance_S),
        "aurc_max_score": diagnostics.aurc(confidence_S, scores_S_C.argmax(axis=1) != target_S),
        "ece": diagnostics.calibration_error(scores_S_C, target_S),
    }


def _of_labels(
    subjects: Subjects, joint: Joint, choices: Mapping[str, Sequence], settings: MeasureSettings
) -> Iterator[Value]:
    """Yield Table III's numbers, by the share of the new concept in the pool."""
    of_kernel = gpc_settings(settings, SCHEDULES[joint["kernel"]])
    for new_share in choices["new_share"]:
        task = make_task(like_the_training(subjects.sets), NEW, settings.labels, *subjects.axes, new_share=new_share)
        gpc = StartedGPC(of_kernel, joint, *subjects.axes, "reading", NEW)
        gpc.fit(task.initial.h, task.initial.concept_N, np.concatenate([task.initial.h, task.pool.h]))
        gpc.level()
        # Random choice has the whole pool, and ends at the target.
        in_rounds = {
            "bald_kmeans": (settings.labels, np.inf),
            "random": (replace(settings.labels, batch=RANDOM_ROUND, labels=len(task.pool)), settings.target),
        }
        for strategy, (rounds_settings, end) in in_rounds.items():
            steps, rows = _steps(task, gpc, strategy, rounds_settings, end, settings.target, subjects.axes)
            values = _labeled(steps, settings.target)
            if strategy == "bald_kmeans":
                values["epochs_at_target"] = _passes(task, rows, of_kernel, joint, settings.target, subjects.axes)
            for metric, value in values.items():
                yield part_name("labels", joint | {"new_share": new_share}), strategy, metric, NEW, value


def _steps(
    task: LabelingTask[np.ndarray],
    gpc: GPC,
    strategy: str,
    settings: ActiveLearningSettings,
    end: float,
    target: float,
    axes: tuple[str, int],
) -> tuple[list[dict[str, float]], list[int]]:
    """Return the rounds up to the first with the accuracy `end`, and the rows of the pool labeled at the target."""
    steps: list[dict[str, float]] = []
    at_target: list[int] = []
    for step, rows in rounds(task.project(gpc), gpc, strategy, settings, *axes, "reading"):
        if all(before["accuracy"] < target for before in steps):
            at_target = list(rows)
        steps.append(step)
        if step["accuracy"] >= end:
            break
    return steps, at_target


def _passes(
    task: LabelingTask[np.ndarray],
    rows: list[int],
    settings: GPCSettings,
    start: Joint,
    target: float,
    axes: tuple[str, int],
) -> float:
    """Return the passes over these labels, a multiple of `LOOK_EVERY` or all, to a new classifier's target accuracy."""
    gpc, most = StartedGPC(settings, start, *axes, "epochs", NEW), settings.iterations
    labeled_L_d = np.concatenate([task.initial.h, task.pool.h[rows]])
    concept_L = np.concatenate([task.initial.concept_N, task.pool.concept_N[rows]])
    for done in gpc.fit_up_to([*range(LOOK_EVERY, most, LOOK_EVERY), most], labeled_L_d, concept_L):
        if accuracies(task.test.concept_N, gpc.attribute(task.test.h)[0])["accuracy", ALL] >= target:
            return float(done)
    return float(most)


def _labeled(steps: list[dict[str, float]], target: float) -> dict[str, float]:
    """Return the metrics of a learning curve; where the target is missed, its labels are a lower bound."""
    hits = [step["accuracy"] >= target for step in steps]
    last = hits.index(True) if any(hits) else len(steps) - 1
    return {
        "labels_to_target": float(steps[last]["labels"]),
        "reached": float(any(hits)),
        "final_accuracy": float(steps[-1]["accuracy"]),
    }


def gpc_settings(settings: MeasureSettings, schedule: tuple[str, float, int]) -> GPCSettings:
    """Return the paper's setting with a row of Table IV's kernel, rate and iterations."""
    kernel, rate, iterations = schedule
    changes = {"kernel": kernel, "learning_rate": rate, "iterations": iterations}
    return GPCSettings(**settings.gpc | changes)


def _combinations(choices: Mapping[str, Sequence], names: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield every combination of the values of these choices."""
    for of_names in product(*(choices[name] for name in names)):
        yield dict(zip(names, of_names, strict=True))
