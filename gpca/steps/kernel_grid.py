"""Step ``fit_kernel_grid``: the classifier by kernel, learning rate and number of iterations (Table IV)."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from gpca.attribution.diagnostics import calibration_error, negative_log_likelihood
from gpca.attribution.predictions import prediction_frame
from gpca.classifier.scores import Attribution
from gpca.classifier.settings import Draws, GPCSettings, Kernel, LearningRate
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Count, Distinct, fields_of

MEASURES = ("accuracy", "elbo", "confidence", "ece", "nll")
SETTING = ("kernel", "learning_rate", "iterations")
GRID_COLUMNS = (*SETTING, *MEASURES)
PRINTED: tuple[tuple[Kernel, float, int], ...] = (  # the rows of the paper's table
    ("rbf", 0.01, 100),
    ("matern32", 0.01, 200),
    ("polynomial", 0.01, 200),
    ("rbf", 0.001, 200),
    ("polynomial", 0.001, 200),
)


@dataclass(frozen=True)
class KernelGrid:
    """The kernels and learning rates that are fitted, and the iterations at which they are evaluated."""

    kernels: Distinct[Kernel] = ("rbf", "matern32", "polynomial")  # each is fitted at every rate
    learning_rates: Distinct[LearningRate] = (0.01, 0.001)
    iterations: Distinct[Count] = (10, 20, 50, 100, 200)  # at which the classifier is evaluated
    inducing: Count = 64
    draws: Draws = 1000


def run(job: Job) -> None:
    grid = KernelGrid(**fields_of(job.settings, KernelGrid))
    files = job.per_seed("registrations", "embeddings", "out", "predictions")
    for seed, registrations, embeddings, out, predictions in files:
        with record_provenance([out, predictions], [registrations, embeddings], job.settings, seed=seed):
            loaded = Registrations.load(registrations, (job.source, seed))
            loaded = replace(loaded, attached=read_embedding(embeddings, loaded))
            rows, prediction_rows = evaluate_grid(loaded, grid, job.source, seed)
            write_csv(out, rows)
            write_csv(predictions, prediction_rows)


def evaluate_grid(registrations: Registrations, grid: KernelGrid, source: str, seed: int) -> tuple[Frame, Frame]:
    """Return `GRID_COLUMNS`, and the predictions of the test samples, which have `SETTING` as first columns."""
    import pandas as pd

    from gpca.classifier.gpc import GPC

    train, test = registrations.rows("train"), registrations.rows("test")
    h_S_d, concept_S = registrations.embedding, registrations.concept
    target_N = np.array([CONCEPTS.index(concept) for concept in concept_S[test]])
    tested, predictions, rows = registrations.subset(test), [], []
    for kernel, rate in product(grid.kernels, grid.learning_rates):
        settings = GPCSettings(kernel, rate, max(grid.iterations), grid.inducing, grid.draws)
        gpc = GPC(CONCEPTS, settings, source, seed)
        for iterations in gpc.fit_up_to(grid.iterations, h_S_d[train], concept_S[train]):
            scores_N_C, variances_N_C, bald_N = gpc.attribute(h_S_d[test])
            attribution = Attribution.of_scores(CONCEPTS, scores_N_C, variances_N_C=variances_N_C, bald_N=bald_N)
            setting = dict(zip(SETTING, (kernel, rate, iterations), strict=True))
            predictions.append(prediction_frame(tested, attribution, **setting))
            measured = (
                np.mean(scores_N_C.argmax(axis=1) == target_N),
                gpc.elbo(),
                scores_N_C.max(axis=1).mean(),
                calibration_error(scores_N_C, target_N),
                negative_log_likelihood(scores_N_C, target_N),
            )
            rows.append((kernel, rate, iterations, *measured))
    return pd.DataFrame(rows, columns=list(GRID_COLUMNS)), pd.concat(predictions, ignore_index=True)
