"""Diagnostics of learners that tests of several tables share."""

import pandas as pd
import pytest

from gpca.evaluation.measures import COLUMNS
from gpca.experiments.out_of_distribution.intervals import RHO
from gpca.experiments.out_of_distribution.tables import SHIFTED

VALUES = {  # learner -> accuracy, ρ, area, ECE
    "gpca": (0.96, 0.52, 0.004, 0.05),
    "learner_forest": (0.95, 0.12, 0.010, 0.10),
    "learner_linear_svm": (0.99, 0.51, 0.020, 0.02),
}


@pytest.fixture
def diagnostics():
    """Return intervals of three learners on YCB, over three seeds, on every set and pair of sets."""
    joined = {"severity": "in_distribution+severity", "source": "in_distribution+source",
              "objects": "seen_objects+objects"}  # fmt: skip
    rows = []

    def add(of_set, learner, metric, value, samples=120):
        own = (f"learners/{of_set}", "ycb", learner, metric, "all", 3, 11, samples)
        rows.append((*own, value, 0.9 * value, 1.01 * value))

    for learner, (accuracy, rho, area, ece) in VALUES.items():
        for of_set in ("in_distribution", "seen_objects", *SHIFTED):
            values = {"accuracy": accuracy, "ece": ece, RHO: rho}
            values |= {f"{name}_max_score": area for name in ("aurc", "excess_aurc", "augrc")}
            for metric, value in values.items():
                add(of_set, learner, metric, value)
        for of_set in joined.values():
            add(of_set, learner, RHO, rho, 240)
    return pd.DataFrame(rows, columns=list(COLUMNS))
