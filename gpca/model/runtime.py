"""How long each stage of GP-CA takes (paper Table VII): each measured in turn, many times, in one process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy, deepcopy
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from gpca.active_learning.acquisition import select
from gpca.active_learning.rounds import Task, initial_gpc, pool_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.canonical_frame import CanonicalFrame
from gpca.alignment.icp import ICP
from gpca.alignment.rigid import inverse, transform
from gpca.attribution.scores import summarise_draws
from gpca.classifier.latents import Projection
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.model.runtime_file import COMPONENTS, RUNTIME_COLUMNS
from gpca.objects.canonical import FEWEST_CLOUD_POINTS
from gpca.pairs.dataset import Registrations
from gpca.progress import progress
from gpca.provenance import cpu_name
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

Result = TypeVar("Result")

WARM_UP = 2  # rounds that do not count: the first calls load compiled functions
STRATEGY = "bald_kmeans"  # the paper's


def measure(
    model: Model,
    registrations: Registrations,
    task: Task[np.ndarray],
    settings: ActiveLearningSettings,
    repeats: int,
    threads: int,
    *axes: object,
) -> pd.DataFrame:
    """Return a row per component and device: mean, standard deviation and median over the repeats, in seconds.

    A repeat goes once through all components with the next test registration, so that whatever else the machine does
    meets all of them.

    Args:
        task: of active learning, not projected yet: its pool is what BALD selects from.
        settings: of active learning.
        axes: names of the draws (source, seed).
    """
    import pandas as pd
    import torch

    gpc = initial_gpc(task, settings, *axes, "runtime")
    projected = task.project(gpc)
    hardware = {"CPU": cpu_name()}
    devices = {"CPU": Explainer(model, device="cpu")}
    if torch.cuda.is_available():
        devices["GPU"] = Explainer(deepcopy(model), device="cuda")  # the encoder cannot be in two places
        hardware["GPU"] = torch.cuda.get_device_name()
    # An explanation refuses clouds of fewer points, which a heavy occlusion can leave.
    rows = [row for row in registrations.rows("test") if len(registrations.cloud(row)) >= FEWEST_CLOUD_POINTS]
    seconds: dict[tuple[str, str], list[float]] = {}
    for repeat in progress(range(WARM_UP + repeats), "runtime"):
        random = generator(*axes, "runtime", repeat)
        pair = _pair(registrations, int(rows[repeat % len(rows)]))
        for key, elapsed in _one_round(devices, model, pair, projected, gpc, settings, random):
            if repeat >= WARM_UP:
                seconds.setdefault(key, []).append(elapsed)
    return pd.DataFrame(
        [
            (component, device, hardware[device], threads, repeats, np.mean(s), np.std(s, ddof=1), np.median(s))
            for (component, device), s in sorted(seconds.items(), key=lambda item: list(COMPONENTS).index(item[0][0]))
        ],
        columns=RUNTIME_COLUMNS,
    )


def _pair(registrations: Registrations, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Return source and target of a registration before ICP, in diameters."""
    T_source_target = inverse(registrations.T_target_source("icp", row))
    return transform(T_source_target, registrations.cloud(row).astype(float)), registrations.target(row).astype(float)


def _one_round(
    devices: dict[str, Explainer], model: Model, pair, task: Task[Projection], gpc, settings, random
) -> Iterator[tuple[tuple[str, str], float]]:
    source, target = pair
    small = [cloud[random.permutation(len(cloud))[:512]] for cloud in pair]
    frame, start = CanonicalFrame(np.zeros(3), 1.0), np.eye(4)

    poses, elapsed = _timed(lambda: BatchedICP(target, model.icp).register(source, start[None])[0])
    yield ("icp", "CPU"), elapsed
    yield ("icp_open3d", "CPU"), _timed(lambda: ICP(target, None, model.icp).register(source, start))[1]
    aligned = transform(poses[0], source)
    for device, explainer in devices.items():
        h_1_d, elapsed = _timed(partial(explainer.embed, aligned))
        yield ("features", device), elapsed
    logits, elapsed = _timed(lambda: _draws(model, h_1_d, random))
    yield ("sampling", "CPU"), elapsed
    yield ("scores", "CPU"), _timed(lambda: summarise_draws(logits))[1]

    left = np.arange(len(task.pool))
    chosen, elapsed = _timed(lambda: select(STRATEGY, pool_of(task, gpc, left, []), settings.batch, random))
    yield ("bald", "CPU"), elapsed
    more, labels, known = task.pool.h[chosen], task.pool.concept_N[chosen], copy(gpc)
    yield ("retraining", "CPU"), _timed(lambda: known.update(more, labels, settings.iterations, settings.tolerance))[1]
    for device, explainer in devices.items():
        for component, (source, target) in (("explanation", pair), ("explanation_512", small)):
            yield (component, device), _timed(partial(explainer.explain, source, target, frame=frame))[1]


def _draws(model: Model, h_1_d: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return M draws of the latents (M, 1, C)."""
    mean_1_C, deviation_1_C = model.gpc.posterior(h_1_d)
    shape = (model.gpc.settings.draws, 1, mean_1_C.shape[1])
    return mean_1_C + deviation_1_C * random.normal(size=shape)


def _timed(work: Callable[[], Result]) -> tuple[Result, float]:
    started = perf_counter()
    result = work()
    return result, perf_counter() - started
