"""Table III under other readings of the pool, of the rounds of labels, of an epoch, and of the classifier."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from gpca.active_learning.retraining import Retraining, learn
from gpca.active_learning.rounds import LabelingTask, initial_gpc, make_task, rounds
from gpca.active_learning.settings import JUDGED_SHARE, ActiveLearningSettings, RareSettings, rare_setting
from gpca.classifier.gpc import GPC
from gpca.errors import InputError
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.settings import read_settings
from gpca.steps.readings.files import Row, RunFiles, Values
from gpca.steps.readings.groups import Reading

NEW = "overlap"  # the paper's new concept
RANDOM_BATCH = 10  # random choice is the same in rounds of any size, and needs many labels
JUDGED = rare_setting(JUDGED_SHARE)
EVERY, MOST = 5, 200  # epochs between looks at the accuracy, and the most of them
STRATEGIES = ("bald_kmeans", "random")


def pool(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Labels and epochs to the target under each reading, by BALD with k-means and by random choice."""
    base, _, target = label_settings(run_files)
    for source, seed, registrations, _ in run_files.in_distribution():
        started: dict[tuple, tuple[LabelingTask, GPC] | None] = {}
        labeled: dict[tuple, Values] = {}
        for reading in progress(readings, f"pools of {source}, seed {seed}"):
            start = (reading["new_share"], reading["initial"])
            settings = replace(base, initial=reading["initial"])
            if start not in started:
                try:
                    task = make_task(registrations, NEW, settings, source, seed, new_share=reading["new_share"])
                    started[start] = (task, initial_gpc(task, settings, source, seed, "reading"))
                except InputError:  # fewer training samples than this reading needs
                    started[start] = None
            if (begun := started[start]) is None:
                continue
            # BALD has the protocol's budget, several times what the paper prints; random choice has the whole pool.
            budgets = {"bald_kmeans": (reading["batch"], settings.labels), "random": (RANDOM_BATCH, len(begun[0].pool))}
            for strategy, (batch, labels) in budgets.items():
                if (key := (*start, strategy, batch)) not in labeled:
                    budget = replace(settings, batch=batch, labels=labels)
                    steps, _ = until(target, *begun, strategy, budget, source, seed)
                    labeled[key] = {
                        ("labels_to_target", NEW): float(steps[-1]["labels"]),
                        ("epochs_at_target", NEW): float(sum(step["epochs"] for step in steps)),
                        ("reached", NEW): float(steps[-1]["accuracy"] >= target),
                    }
                yield reading, source, strategy, seed, labeled[key]


Steps = tuple[list[dict[str, float]], list[list[int]]]  # and the rows of the pool that are labeled then


def until(
    accuracy: float, task: LabelingTask, gpc: GPC, strategy: str, settings: ActiveLearningSettings, *axes: object
) -> Steps:
    """Rounds to the first of that accuracy, or all of them."""
    steps, labeled = [], []
    for step, rows in rounds(task.project(gpc), gpc, strategy, settings, *axes, "reading"):
        steps.append(step)
        labeled.append(rows)
        if step["accuracy"] >= accuracy:
            break
    return steps, labeled


def epochs(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Passes of Adam that a new classifier takes to the target, and whether it gets there, on the protocol's labels."""
    base, rare, target = label_settings(run_files)
    for source, seed, registrations, _ in run_files.in_distribution():
        axes = source, seed, JUDGED
        task = make_task(registrations, NEW, base, source, seed, new_share=JUDGED_SHARE)
        learned = learn(Retraining(task, rare.gpc, *axes), "bald_kmeans", rare, [target], *axes)
        queried = {"at_target": learned.labels_to(target), "all": learned.queried}
        for reading in progress(readings, f"epochs on {source}, seed {seed}"):
            rows = queried[reading["labels"]]
            settings = replace(rare.gpc, learning_rate=reading["learning_rate"])
            gpc = GPC(CONCEPTS, settings, source, seed, "epochs")
            passes, reached = passes_to(target, gpc, task, rows, range(EVERY, MOST + 1, EVERY))
            yield reading, source, "bald_kmeans", seed, {("epochs_at_target", NEW): passes, ("reached", NEW): reached}


def passes_to(
    accuracy: float, gpc: GPC, task: LabelingTask[np.ndarray], rows: Sequence[int], looks: Iterable[int]
) -> tuple[float, float]:
    """Passes of a new classifier over initial and these samples to an accuracy, and 1.0; else all passes and 0.0."""
    h_L_d = np.concatenate([task.initial.h, task.pool.h[rows]])
    passes, concept_L = 0, np.concatenate([task.initial.concept_N, task.pool.concept_N[rows]])
    for passes in gpc.fit_up_to(looks, h_L_d, concept_L):
        named_N = np.array(CONCEPTS)[gpc.attribute(task.test.h)[0].argmax(axis=1)]
        if np.mean(named_N == task.test.concept_N) >= accuracy:
            return float(passes), 1.0
    return float(passes), 0.0


def classifiers(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Labels and epochs to the target by the classifier, also by that of the protocol."""
    base, rare, target = label_settings(run_files)
    for source, seed, registrations, _ in run_files.in_distribution():
        axes = source, seed, JUDGED
        task = make_task(registrations, NEW, base, source, seed, new_share=JUDGED_SHARE)
        for reading in progress(readings, f"classifiers of {source}, seed {seed}"):
            settings = replace(rare.gpc, learning_rate=reading["learning_rate"], iterations=reading["iterations"])
            start, sees_pool = reading["start"], reading["inputs"] == "pool"
            for strategy in STRATEGIES:
                if start == "posterior":
                    around = np.concatenate([task.initial.h, task.pool.h]) if sees_pool else None
                    gpc = GPC(CONCEPTS, settings, *axes, "posterior")
                    gpc.fit(task.initial.h, task.initial.concept_N, around).level()
                    batch = RANDOM_BATCH if strategy == "random" else rare.batch
                    budget = replace(base, batch=batch, labels=rare.labels)
                    steps, _ = until(target, task, gpc, strategy, budget, *axes)
                else:
                    retraining = Retraining(task, settings, *axes, warm=start == "warm", sees_pool=sees_pool)
                    steps = learn(retraining, strategy, rare, [target], *axes).steps
                at = next((step for step in steps if step["accuracy"] >= target), steps[-1])
                values = {"labels_to_target": at["labels"], "reached": at["accuracy"] >= target}
                if start != "posterior":  # whose passes are no epochs of Adam
                    values["epochs_at_target"] = at["epochs"]
                of_new = {(metric, NEW): float(value) for metric, value in values.items()}
                yield reading, source, strategy, seed, of_new


def label_settings(run_files: RunFiles) -> tuple[ActiveLearningSettings, RareSettings, float]:
    """Settings of the protocol, those of the row that is judged, in which the concept is rare; the target accuracy."""
    section = run_files.section("active_learning")
    return ActiveLearningSettings.from_dict(section), read_settings(RareSettings, section["rare"]), section["target"]
