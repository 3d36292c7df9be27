"""Step ``runtime``: model, registrations and embeddings -> ``runtime.csv``, the seconds of every stage."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from gpca.active_learning.rounds import LabelingTask, initial_gpc, make_task
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.experiments.runtime.stage_times import CloudPair, time_explanations, time_labeling, time_stages
from gpca.io.csv_file import write_csv
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.model.runtime_file import COMPONENTS, RUNTIME_COLUMNS
from gpca.objects.canonical import FEWEST_CLOUD_POINTS
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.processor import cpu_name
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

WARM_UP = 2  # rounds that do not count: the first calls load compiled functions
SMALL = 512  # points of the smaller explanation


def run(job: Job) -> None:
    """Measure every component, repeat by repeat."""
    axes = (job.source, job.seed)
    inputs = [job.model, job.registrations, job.embeddings]
    with record_provenance([job.out], inputs, job.settings, seed=job.seed):
        model = Model.load(job.model)
        registrations = Registrations.load(job.registrations, axes)
        embedded = replace(registrations, attached=read_embedding(job.embeddings, registrations))
        settings = ActiveLearningSettings.from_dict(job.section("active_learning"))
        task = make_task(embedded, "overlap", settings, *axes)
        repeats = job.section("runtime").get("repeats", 100)
        write_csv(job.out, measure(model, registrations, task, settings, repeats, job.threads, *axes))


def measure(
    model: Model,
    registrations: Registrations,
    task: LabelingTask[np.ndarray],
    settings: ActiveLearningSettings,
    repeats: int,
    threads: int,
    *axes: object,
) -> pd.DataFrame:
    """Return a row per component and device: mean, standard deviation and median over the repeats, in seconds.

    A repeat goes once through all components with the next test registration, so that whatever else the machine does
    meets all of them.

    Args:
        task: an experiment of active learning, not projected yet; BALD selects from its pool.
        settings: those of active learning.
        axes: the names of the draws (source, seed).
    """
    import pandas as pd
    import torch

    gpc = initial_gpc(task, settings, *axes, "runtime")
    projected = task.project(gpc)
    hardware = {"CPU": cpu_name()}
    explainers = {"CPU": Explainer(model, device="cpu")}
    if torch.cuda.is_available():
        explainers["GPU"] = Explainer(deepcopy(model), device="cuda")  # the encoder cannot be in two places
        hardware["GPU"] = torch.cuda.get_device_name()
    # An explanation refuses clouds of fewer points, which a heavy occlusion can leave.
    rows = [row for row in registrations.rows("test") if len(registrations.cloud(row)) >= FEWEST_CLOUD_POINTS]
    seconds: dict[tuple[str, str], list[float]] = {}
    for repeat in progress(range(WARM_UP + repeats), "runtime"):
        random = generator(*axes, "runtime", repeat)
        source, target = _pair(registrations, int(rows[repeat % len(rows)]))
        small = (_drawn(source, random), _drawn(target, random))
        times = chain(
            time_stages(explainers, model, (source, target), random),
            time_labeling(projected, gpc, settings, random),
            time_explanations(explainers, {"explanation": (source, target), "explanation_512": small}),
        )
        for key, elapsed in times:
            if repeat >= WARM_UP:
                seconds.setdefault(key, []).append(elapsed)
    return pd.DataFrame(
        [
            (component, device, hardware[device], threads, repeats, np.mean(s), np.std(s, ddof=1), np.median(s))
            for (component, device), s in sorted(seconds.items(), key=lambda item: list(COMPONENTS).index(item[0][0]))
        ],
        columns=RUNTIME_COLUMNS,
    )


def _pair(registrations: Registrations, row: int) -> CloudPair:
    """Return source and target of a registration before ICP, in diameters."""
    return registrations.source(row), registrations.target(row).astype(float)


def _drawn(cloud: np.ndarray, random: np.random.Generator) -> np.ndarray:
    return cloud[random.permutation(len(cloud))[:SMALL]]
