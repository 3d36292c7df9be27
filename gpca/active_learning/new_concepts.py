"""One new concept, learned from one embedding: the rounds of the paper's strategy, random ones, and all labels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from gpca.active_learning.rounds import Embedded, LabelingTask, initial_gpc, make_task, run_rounds, step_of
from gpca.active_learning.settings import ALL_LABELS, ActiveLearningSettings
from gpca.classifier.gpc import GPC
from gpca.seeds import generator


def answers(concept_N: np.ndarray, classes: tuple[str, ...], share: float, *axes: object) -> np.ndarray:
    """Return an oracle's answers for N samples, some of them wrong.

    Which samples it errs about, and what it says of them, is drawn once for all shares: an oracle that errs more often
    repeats the errors of a better one, so that the two differ in nothing else.

    Args:
        concept_N: the truth.
        classes: what it may say.
        share: of the N samples, of which a wrong concept is named.
        axes: names of the draw.
    """
    random = generator(*axes, "oracle")
    order = random.permutation(len(concept_N))
    steps_N = random.integers(1, len(classes), size=len(concept_N))
    wrong = order[: round(share * len(concept_N))]
    said_N = np.array([classes.index(concept) for concept in concept_N], int)
    said_N[wrong] = (said_N[wrong] + steps_N[wrong]) % len(classes)
    return np.array(classes)[said_N]


@dataclass(frozen=True)
class NewConceptTrial:
    """One trial: a new concept, seen through one embedding.

    Attributes:
        embedding: its name.
        samples: the samples, embedded by it.
        held_out: the new concept.
        classes: all concepts.
        errors: shares of wrong answers of the oracles that are asked besides the one that never errs.
    """

    embedding: str
    samples: Embedded
    held_out: str
    classes: tuple[str, ...]
    errors: tuple[float, ...] = ()


def setting_of(embedding: str, errors: float) -> str:
    """Return the name, in a file of curves, of an embedding and an oracle that errs in a share of its answers."""
    return f"{embedding}_errors_{round(100 * errors)}" if errors else embedding


def run_trial(
    trial: NewConceptTrial, strategies: Iterable[str], settings: ActiveLearningSettings, *axes: object
) -> Iterator[tuple[str, str, list[dict[str, float]]]]:
    """Yield setting, strategy and learning curve of each run (:func:`gpca.active_learning.rounds.run_rounds`).

    Start, pool and the strategies' draws are the same for all oracles. All labels are those of the one that never errs.
    """
    held_out, classes = trial.held_out, trial.classes
    task = make_task(trial.samples, held_out, settings, *axes, classes=classes)
    axes = (*axes, trial.embedding)
    gpc = initial_gpc(task, settings, *axes, classes=classes)
    projected = task.project(gpc)
    for errors in (0.0, *trial.errors):
        answers_N = answers(task.pool.concept_N, classes, errors, *axes, held_out)
        for strategy in strategies:
            if strategy != ALL_LABELS:
                curve = run_rounds(projected, gpc, strategy, settings, *axes, answers_N=answers_N)
            elif not errors:
                curve = [step_of(projected, gpc, [], epochs=0), _with_all_labels(task, classes, settings, *axes)]
            else:
                continue
            yield setting_of(trial.embedding, errors), strategy, curve


def _with_all_labels(
    task: LabelingTask[np.ndarray], classes: tuple[str, ...], settings: ActiveLearningSettings, *axes: object
) -> dict[str, float]:
    """Return the step after the whole pool is labeled: of a classifier that is fitted anew, as labels alone allow."""
    h_L_d = np.concatenate([task.initial.h, task.pool.h])
    labels_L = np.concatenate([task.initial.concept_N, task.pool.concept_N])
    gpc = GPC(classes, settings.gpc, *axes, ALL_LABELS, task.held_out).fit(h_L_d, labels_L)
    return step_of(task.project(gpc), gpc, list(range(len(task.pool))), settings.gpc.iterations)
