"""Learning a new concept with a full fit of the classifier in every round, as in the paper (Sec. III-C, IV-C)."""

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
    """Fits classifiers on growing sets of labels: `warm` from the last one; `sees_pool`: started on the pool too."""

    def __init__(
        self,
        task: LabelingTask[np.ndarray],
        settings: GPCSettings,
        *axes: object,
        warm: bool = False,
        sees_pool: bool = False,
    ) -> None:
        self.task, self.settings = task, settings
        self._axes = (*axes, "retraining", task.held_out)
        self._warm, self._sees_pool = warm, sees_pool

    def fit(self, queried: Sequence[int], before: GPC | None) -> GPC:
        """Return the classifier of the initial labels and of these rows of the pool; the last one is not changed."""
        [(_, gpc)] = self.fit_up_to([self.settings.iterations], queried, before)
        return gpc

    def fit_up_to(
        self, iterations: Iterable[int], queried: Sequence[int], before: GPC | None
    ) -> Iterator[tuple[int, GPC]]:
        """Yield each number of passes over the labels, in rising order, and the classifier after it."""
        h_L_d, concept_L = self.task.labeled(list(queried))
        around = self.task.labeled()[0] if self._sees_pool else None
        gpc = GPC(CONCEPTS, self.settings, *self._axes)
        for done in gpc.fit_up_to(iterations, h_L_d, concept_L, around, before if self._warm else None):
            yield done, gpc

    def passes(self, target: float, queried: Sequence[int], before: GPC | None) -> int:
        """Return the number of passes, a multiple of `LOOK_EVERY` or all, that first reaches this accuracy."""
        most = self.settings.iterations
        counts = [*range(LOOK_EVERY, most, LOOK_EVERY), most]
        fits = self.fit_up_to(counts, queried, before)
        return next((done for done, gpc in fits if self.look(gpc, queried)["accuracy"] >= target), most)

    def look(self, gpc: GPC, queried: Sequence[int]) -> Step:
        """Return the step after these labels, see :func:`gpca.active_learning.rounds.rounds`."""
        return step_of(self.task, gpc, list(queried), self.settings.iterations if queried else 0)


@dataclass(frozen=True)
class Learned:
    """A learning curve, and the rows of the pool in the order of their labels."""

    steps: list[Step]
    queried: list[int]

    def labels_to(self, target: float) -> list[int]:
        """Return the rows labeled until the target was reached, or all."""
        labels = next((int(step["labels"]) for step in self.steps if step["accuracy"] >= target), len(self.queried))
        return self.queried[:labels]


def learn(
    retraining: Retraining, strategy: str, settings: RetrainingSettings, targets: Sequence[float], *axes: object
) -> Learned:
    """Spend labels with one strategy until all target accuracies are reached, and at least `settings.least`.

    In a round that first reaches a target, labels are also added one by one: the curve has a step at each target. With
    a single one, its ``epochs`` are the passes up to the target.
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
        added, missing = [], sorted(reached)
        for given in range(1, len(chosen)):
            if not missing:
                break
            rows = queried + chosen[:given]
            step = retraining.look(retraining.fit(rows, before), rows)
            if step["accuracy"] >= missing[0]:
                missing = [target for target in missing if step["accuracy"] < target]
                added.append(step)
        added.append(last)
        if len(targets) == 1 and reached:
            rows = queried + chosen[: int(added[0]["labels"]) - len(queried)]
            added[0]["epochs"] = retraining.passes(targets[0], rows, before)
        steps += added
        queried += chosen
        open_targets = [target for target in open_targets if target not in reached]
    return Learned(steps, queried)
