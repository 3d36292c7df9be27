"""Step ``time_stages``: model, registrations and embeddings -> ``runtime.csv``, the seconds of every stage."""

from collections.abc import Iterator, Mapping
from copy import copy, deepcopy
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np

from gpca.active_learning.acquisition import select
from gpca.active_learning.rounds import LabelingTask, initial_gpc, make_task, pool_of
from gpca.active_learning.settings import ActiveLearningSettings
from gpca.alignment.batched_icp import icp_to
from gpca.alignment.icp import ICP
from gpca.classifier.gpc import GPC
from gpca.classifier.latents import Projection
from gpca.classifier.scores import summarize_draws
from gpca.evaluation.runtime_file import COMPONENTS, RUNTIME_COLUMNS
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.objects.canonical import FEWEST_CLOUD_POINTS, CanonicalFrame
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.processor import cpu_name
from gpca.process.progress import progress
from gpca.rigid import transform
from gpca.seeds import generator
from gpca.steps.registration_trials import timed

WARM_UP = 2  # rounds that do not count: the first calls load compiled functions
SMALL = 512  # points of the smaller explanation
STRATEGY = "bald_kmeans"  # of active learning, the paper's
CloudPair = tuple[np.ndarray, np.ndarray]  # source and target (N, 3), in diameters
Times = Iterator[tuple[tuple[str, str], float]]  # (component, device) and its seconds


def run(job: Job) -> None:
    inputs = [job.model, job.registrations, job.embeddings]
    with record_provenance([job.out], inputs, job.settings, seed=job.seed):
        model = Model.load(job.model)
        registrations = Registrations.load(job.registrations, job.axes)
        embedded = replace(registrations, attached=read_embedding(job.embeddings, registrations))
        settings = ActiveLearningSettings.from_dict(job.section("active_learning"))
        task = make_task(embedded, "overlap", settings, *job.axes)
        repeats = job.section("runtime").get("repeats", 100)
        write_csv(job.out, measure(model, registrations, task, settings, repeats, job.threads, *job.axes))


def measure(
    model: Model,
    registrations: Registrations,
    task: LabelingTask[np.ndarray],
    settings: ActiveLearningSettings,
    repeats: int,
    threads: int,
    *axes: object,
) -> Frame:
    """Return a row per component and device: mean, standard deviation and median over the repeats, in seconds."""
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
    # A repeat goes through all components, so that whatever else the machine does meets all of them.
    for repeat in progress(range(WARM_UP + repeats), "runtime"):
        random = generator(*axes, "runtime", repeat)
        row = int(rows[repeat % len(rows)])
        pair = registrations.source(row), registrations.target(row).astype(float)
        source, target = (cloud[random.permutation(len(cloud))[:SMALL]] for cloud in pair)
        times = chain(
            time_stages(explainers, model, pair, random),
            time_labeling(projected, gpc, settings, random),
            time_explanations(explainers, {"explanation": pair, "explanation_512": (source, target)}),
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


def time_stages(
    explainers: Mapping[str, Explainer], model: Model, pair: CloudPair, random: np.random.Generator
) -> Times:
    """Times of ICP, feature extraction by the explainer of each device, posterior sampling and the scores."""
    source, target = pair
    start = np.eye(4)
    poses, elapsed = timed(lambda: icp_to(target, model.icp).register(source, start[None])[0])
    yield ("icp", "CPU"), elapsed
    yield ("icp_open3d", "CPU"), timed(lambda: ICP(target, None, model.icp).register(source, start))[1]
    aligned = transform(poses[0], source)
    for device, explainer in explainers.items():
        h_1_d, elapsed = timed(explainer.embed, aligned)
        yield ("features", device), elapsed

    def draws_M_1_C() -> np.ndarray:
        mean_1_C, deviation_1_C = model.gpc.posterior(h_1_d)
        return mean_1_C + deviation_1_C * random.normal(size=(model.gpc.settings.draws, 1, mean_1_C.shape[1]))

    logits, elapsed = timed(draws_M_1_C)
    yield ("sampling", "CPU"), elapsed
    yield ("scores", "CPU"), timed(summarize_draws, logits)[1]


def time_explanations(explainers: Mapping[str, Explainer], pairs: Mapping[str, CloudPair]) -> Times:
    """Times of one explanation of each pair, component -> pair, on every device."""
    frame = CanonicalFrame(np.zeros(3), 1.0)
    for device, explainer in explainers.items():
        for component, (source, target) in pairs.items():
            yield (component, device), timed(partial(explainer.explain, source, target, frame=frame))[1]


def time_labeling(
    task: LabelingTask[Projection], gpc: GPC, settings: ActiveLearningSettings, random: np.random.Generator
) -> Times:
    """Times of BALD selection from the pool projected by `gpc`, and of the update of a copy of the classifier."""
    left = np.arange(len(task.pool))
    chosen, elapsed = timed(lambda: select(STRATEGY, pool_of(task, gpc, left, []), settings.batch, random))
    yield ("bald", "CPU"), elapsed
    more, labels, known = task.pool.h[chosen], task.pool.concept_N[chosen], copy(gpc)
    yield ("retraining", "CPU"), timed(lambda: known.update(more, labels, settings.iterations, settings.tolerance))[1]
