"""The seconds of the stages of one explanation, of whole explanations, and of one round of active learning."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from functools import partial
from time import perf_counter
from typing import TypeVar

import numpy as np

from gpca.active_learning.acquisition import select
from gpca.active_learning.rounds import LabelingTask, pool_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICP
from gpca.alignment.rigid import transform
from gpca.attribution.scores import summarize_draws
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.objects.canonical_frame import CanonicalFrame

STRATEGY = "bald_kmeans"  # of active learning, the paper's
Result = TypeVar("Result")
CloudPair = tuple[np.ndarray, np.ndarray]  # source and target (N, 3), in diameters
Times = Iterator[tuple[tuple[str, str], float]]  # (component, device) and its seconds


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return the result of a function, and the seconds that it took."""
    started = perf_counter()
    result = work()
    return result, perf_counter() - started


def time_stages(
    explainers: Mapping[str, Explainer], model: Model, pair: CloudPair, random: np.random.Generator
) -> Times:
    """Measure ICP, feature extraction, posterior sampling and the scores.

    Args:
        explainers: one per device, which extracts features there.
        pair: the clouds before ICP.
    """
    source, target = pair
    start = np.eye(4)
    poses, elapsed = timed(lambda: BatchedICP(target, model.icp).register(source, start[None])[0])
    yield ("icp", "CPU"), elapsed
    yield ("icp_open3d", "CPU"), timed(lambda: ICP(target, None, model.icp).register(source, start))[1]
    aligned = transform(poses[0], source)
    for device, explainer in explainers.items():
        h_1_d, elapsed = timed(partial(explainer.embed, aligned))
        yield ("features", device), elapsed
    logits, elapsed = timed(lambda: _draws(model, h_1_d, random))
    yield ("sampling", "CPU"), elapsed
    yield ("scores", "CPU"), timed(lambda: summarize_draws(logits))[1]


def time_explanations(explainers: Mapping[str, Explainer], pairs: Mapping[str, CloudPair]) -> Times:
    """Measure one explanation of each pair, component -> pair, on every device."""
    frame = CanonicalFrame(np.zeros(3), 1.0)
    for device, explainer in explainers.items():
        for component, (source, target) in pairs.items():
            yield (component, device), timed(partial(explainer.explain, source, target, frame=frame))[1]


def _draws(model: Model, h_1_d: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return M draws of the latents (M, 1, C)."""
    mean_1_C, deviation_1_C = model.gpc.posterior(h_1_d)
    shape = (model.gpc.settings.draws, 1, mean_1_C.shape[1])
    return mean_1_C + deviation_1_C * random.normal(size=shape)


def time_labeling(
    task: LabelingTask[Projection], gpc: GPC, settings: ActiveLearningSettings, random: np.random.Generator
) -> Times:
    """Measure BALD selection from the whole pool, and the update of a copy of the classifier.

    Args:
        task: projected by `gpc`.
    """
    left = np.arange(len(task.pool))
    chosen, elapsed = timed(lambda: select(STRATEGY, pool_of(task, gpc, left, []), settings.batch, random))
    yield ("bald", "CPU"), elapsed
    more = task.pool.h[chosen]
    labels = task.pool.concept_N[chosen]
    known = copy(gpc)
    yield ("retraining", "CPU"), timed(lambda: known.update(more, labels, settings.iterations, settings.tolerance))[1]
