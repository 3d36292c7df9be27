"""What the tests of the page share."""

import numpy as np
import pytest

from gpca.attribution import Attribution
from gpca.perturbation import CONCEPTS
from gpca.predictions import write_predictions


@pytest.fixture(scope="session")
def predicted():
    """Write registrations, and predictions on them by dice, into a folder; return both paths."""

    def write(registrations, folder, source="bricks"):
        npz, csv = folder / f"registrations/{source}/seed0.npz", folder / f"predictions/{source}/gpca/seed0.csv"
        random, N = np.random.default_rng(3), len(registrations)
        scores_N_C = random.dirichlet(np.ones(len(CONCEPTS)), N)
        registrations.save(npz)
        attribution = Attribution(
            concepts=CONCEPTS,
            scores_N_C=scores_N_C,
            variances_N_C=random.uniform(0.001, 0.01, scores_N_C.shape),
            bald_N=random.uniform(size=N),
            abstained_N=np.zeros(N, dtype=bool),
            icp_calls_N=np.zeros(N, dtype=int),
            seconds_N=np.zeros(N),
            icp_seconds_N=np.zeros(N),
        )
        write_predictions(csv, registrations, attribution)
        return npz, csv

    return write
