"""Step ``learners``: embeddings of all sets -> predictions of every learner for their test samples."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import prediction_frame
from gpca.errors import InputError
from gpca.experiments.out_of_distribution.sets import TRAINED_ON, ShiftedSets
from gpca.explainers.interface import ConceptExplainer
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance

if TYPE_CHECKING:
    import pandas as pd


def run(job: Job) -> None:
    """Fit every learner and let it explain, seed by seed."""
    for learner in job.learners:
        if explainer_entry(learner).reads != "embeddings":
            raise InputError(f"learner '{learner}'", "does not read embeddings", "choose another")

    for i, (seed, path) in enumerate(job.per_seed("sets")):
        sets = ShiftedSets.load(path, (job.source, seed))
        outputs = job.out[i :: len(job.seeds)]
        title = f"learners on {job.source}, seed {seed}"
        for learner, out in progress(list(zip(job.learners, outputs, strict=True)), title):
            settings = job.section(learner)
            with record_provenance([out], [path], settings, seed=seed):
                make = partial(explainer_entry(learner).make, job.source, seed, **settings)
                write_csv(out, predict_sets(make, sets))


def predict_sets(make: Callable[[], ConceptExplainer], sets: ShiftedSets) -> pd.DataFrame:
    """Fit a learner to the training samples of each encoder and let it explain the test samples of its sets.

    Args:
        make: returns a new learner at every call.
        sets: the samples.

    Returns:
        the columns of a prediction file, with `set` before them.
    """
    import pandas as pd

    frames = []
    for home in dict.fromkeys(TRAINED_ON.values()):
        names = [name for name, trained_on in TRAINED_ON.items() if trained_on == home]
        rows = np.concatenate([sets.rows(name, "test") for name in names])
        if not len(rows):
            continue
        learner = make()
        learner.fit(sets.registrations(sets.rows(home, "train")))
        test = sets.registrations(rows)
        frame = prediction_frame(test, learner.explain(test.without_labels()))
        frame.insert(0, "set", sets.set[rows])
        frames.append(frame)
    return pd.concat(frames, ignore_index=True)
