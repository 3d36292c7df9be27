"""Learning a new concept as the paper describes it: every round fits the classifier to all labels (Sec. III-C, IV-C).

In :mod:`gpca.active_learning.rounds` further labels move the posterior alone, which takes a hundredth of the time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gpca.active_learning.acquisition import require_strategy, select
from gpca.active_learning.rounds import LabelingTask, pool_of, step_of
from gpca.active_learning.settings import LOOK_EVERY, RetrainingSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

Step = dict[str, float]


class Retraining:
    """Classifiers of the labels that were given so far.

    Args:
        task: the start, pool and test samples, not projected.
        settings: of the classifier.
        axes: the names of the draws.
        warm: whether a fit starts from what the one before learned, and not anew.
        sees_pool: whether inputs are scaled, and inducing inputs and lengthscale start, by the pool too, or by the
            labeled samples alone.
    """

    def __init__(
        self,
        task: LabelingTask[np.ndarray],
        settings: GPCSettings,
        *axes: object,
        warm: bool = False,
        sees_pool: bool = False,
    ) -> None:
        self.task = task
        self.settings = settings
        self._axes = (*axes, "retraining", task.held_out)
        self._warm = warm
        self._sees_pool = sees_pool

    def fit(self, queried: Sequence[int], before: GPC | None) -> GPC:
        """Return the classifier of the start's labels and those of these rows of the pool.

        Args:
            queried: rows of the pool.
            before: the classifier before the last of them were given; it is not changed.
        """
        [(_, gpc)] = self.fit_up_to([self.settings.iterations], queried, before)
        return gpc

    def fit_up_to(
        self, iterations: Iterable[int], queried: Sequence[int], before: GPC | None
    ) -> Iterator[tuple[int, GPC]]:
        """Yield each of these counts in rising order, and the classifier after so many passes over the labels."""
        initial, pool = self.task.initial, self.task.pool
        rows = list(queried)
        h_L_d = np.concatenate([initial.h, pool.h[rows]])
        concept_L = np.concatenate([initial.concept_N, pool.concept_N[rows]])
        around = np.concatenate([initial.h, pool.h]) if self._sees_pool else None
        gpc = GPC(CONCEPTS, self.settings, *self._axes)
        continued = before if self._warm else None
        for done in gpc.fit_up_to(iterations, h_L_d, concept_L, around, continued):
            yield done, gpc

    def passes(self, target: float, queried: Sequence[int], before: GPC | None) -> int:
        """Return the passes, a multiple of `LOOK_EVERY` or all, after which the classifier is first that accurate."""
        most = self.settings.iterations
        counts = [*range(LOOK_EVERY, most, LOOK_EVERY), most]
        fits = self.fit_up_to(counts, queried, before)
        return next((done for done, gpc in fits if self.look(gpc, queried)["accuracy"] >= target), most)

    def look(self, gpc: GPC, queried: Sequence[int]) -> Step:
        """Return the step of a learning curve after these labels (:func:`gpca.active_learning.rounds.run_rounds`)."""
        return step_of(self.task, gpc, list(queried), self.settings.iterations if queried else 0)


@dataclass(frozen=True)
class Learned:
    """A learning curve, and the rows of the pool in the order in which they were labeled."""

    steps: list[Step]
    queried: list[int]

    def labels_to(self, target: float) -> list[int]:
        """Return the rows that were labeled until the target was reached, or all of them."""
        labels = next((int(step["labels"]) for step in self.steps if step["accuracy"] >= target), len(self.queried))
        return self.queried[:labels]


def learn(
    retraining: Retraining, strategy: str, settings: RetrainingSettings, targets: Sequence[float], *axes: object
) -> Learned:
    """Spend labels by one strategy until all targets are reached, and `settings.least` at least.

    In a round that reaches a target first, its labels are also learned one by one, so that they are counted exactly;
    where a strategy ranks them, the most uncertain comes first.

    Args:
        retraining: the classifiers.
        strategy: by name.
        settings: of the rounds.
        targets: accuracies on the test samples, at each of which the curve has a step. With a single one, ``epochs`` of
            that step are the passes up to the target, not those of the whole retraining.
        axes: the names of the strategy's draws.
    """
    task = retraining.task
    random = generator(*axes, "retraining", task.held_out, strategy)
    needs_scores = require_strategy(strategy).needs_scores
    queried: list[int] = []
    gpc = retraining.fit(queried, None)
    steps = [retraining.look(gpc, queried)]
    open_targets = [target for target in targets if steps[0]["accuracy"] < target]
    while len(queried) < min(settings.labels, len(task.pool)):
        if not open_targets and len(queried) >= settings.least:
            break
        left = np.setdiff1d(np.arange(len(task.pool)), queried)
        size = settings.batch if len(queried) < settings.least else settings.late_batch
        pool = pool_of(task.project(gpc), gpc, left, queried, needs_scores)
        chosen = left[select(strategy, pool, min(size, settings.labels - len(queried)), random)].tolist()
        before, gpc = gpc, retraining.fit(queried + chosen, gpc)
        last = retraining.look(gpc, queried + chosen)
        reached = [target for target in open_targets if last["accuracy"] >= target]
        of_round = [*_first_at(retraining, reached, queried, chosen, before), last]
        if len(targets) == 1 and reached:
            rows = queried + chosen[: int(of_round[0]["labels"]) - len(queried)]
            of_round[0]["epochs"] = retraining.passes(targets[0], rows, before)
        steps += of_round
        queried += chosen
        open_targets = [target for target in open_targets if target not in reached]
    return Learned(steps, queried)


def _first_at(
    retraining: Retraining, targets: Sequence[float], queried: list[int], chosen: list[int], before: GPC
) -> Iterator[Step]:
    """Yield the steps within a round, which reaches these targets, at which one is reached first."""
    missing = sorted(targets)
    for given in range(1, len(chosen)):
        if not missing:
            return
        rows = queried + chosen[:given]
        step = retraining.look(retraining.fit(rows, before), rows)
        if step["accuracy"] >= missing[0]:
            missing = [target for target in missing if step["accuracy"] < target]
            yield step
