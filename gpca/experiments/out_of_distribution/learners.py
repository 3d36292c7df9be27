"""Predictions of learners for samples like and unlike those that they were fitted to."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import prediction_frame
from gpca.experiments.out_of_distribution.sets import TRAINED_ON, ShiftedSets
from gpca.explainers.interface import ConceptExplainer

if TYPE_CHECKING:
    import pandas as pd


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
        asked = sets.registrations(rows)
        frame = prediction_frame(asked, learner.explain(asked.without_labels()))
        frame.insert(0, "set", sets.set[rows])
        frames.append(frame)
    return pd.concat(frames, ignore_index=True)
