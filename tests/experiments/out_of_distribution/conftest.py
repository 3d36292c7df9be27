"""Diagnostics of learners that tests of several tables share."""

import pandas as pd
import pytest

from gpca.attribution.metrics import TIDY_COLUMNS
from gpca.experiments.out_of_distribution.tables import RHO, SHIFTED

VALUES = {  # learner -> accuracy, ρ, area, ECE over three seeds
    "gpca": ([0.95, 0.96, 0.97], [0.50, 0.52, 0.54], 0.004, 0.05),
    "learner_forest": ([0.94, 0.96, 0.98], [0.10, 0.11, 0.15], 0.010, 0.10),
    "learner_linear_svm": ([0.98, 0.99, 1.00], [0.49, 0.55, 0.52], 0.020, 0.02),
}


@pytest.fixture
def diagnostics():
    """Return tidy diagnostics of three learners on YCB, over three seeds, on every set and pair of sets."""
    joined = {"severity": "in_distribution+severity", "source": "in_distribution+source",
              "objects": "seen_objects+objects"}  # fmt: skip
    records = []

    def add(of_set, learner, metric, values):
        records.extend((f"learners/{of_set}", "ycb", learner, metric, "all", seed, v) for seed, v in enumerate(values))

    for learner, (accuracy, rho, area, ece) in VALUES.items():
        for of_set in ("in_distribution", "seen_objects", *SHIFTED):
            add(of_set, learner, "accuracy", accuracy)
            add(of_set, learner, "ece", [ece] * 3)
            add(of_set, learner, "test_samples", [40] * 3)
            for name in ("aurc", "excess_aurc", "augrc"):
                add(of_set, learner, f"{name}_max_score", [area] * 3)
            add(of_set, learner, RHO, rho)
        for of_set in joined.values():
            add(of_set, learner, RHO, rho)
    return pd.DataFrame(records, columns=list(TIDY_COLUMNS))
