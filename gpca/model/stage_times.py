"""The seconds of the stages of one explanation, each measured by itself, and those of whole explanations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from time import perf_counter
from typing import TypeVar

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.canonical_frame import CanonicalFrame
from gpca.alignment.icp import ICP
from gpca.alignment.rigid import transform
from gpca.attribution.scores import summarise_draws
from gpca.model.explainer import Explainer
from gpca.model.file import Model

Result = TypeVar("Result")
CloudPair = tuple[np.ndarray, np.ndarray]  # source and target (N, 3), in diameters
Times = Iterator[tuple[tuple[str, str], float]]  # (component, device) and its seconds


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """Return what a function returns, and the seconds that it took."""
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
    yield ("scores", "CPU"), timed(lambda: summarise_draws(logits))[1]


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
