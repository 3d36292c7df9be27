"""Monte-Carlo: the covariance of what the method finds from many initial poses, with the clouds as they are.

It models the starts alone, as the uncertainty of ICP in the paper that this suite is about.
"""

from __future__ import annotations

import numpy as np

from gpca.seeds import generator
from gpca.uncertainty.estimators.interface import EstimatorEntry, RegisteredPair


def estimate(registered: RegisteredPair, starts: int = 50) -> np.ndarray:
    """Return Σ = cov(log(T T̂⁻¹)) over the results of so many starts; their mean is no part of it."""
    return np.cov(sample(registered, starts, "monte_carlo"), rowvar=False)


def sample(registered: RegisteredPair, starts: int, *axes: object) -> np.ndarray:
    """Return the twists (m, 6) of the results from starts that are drawn by the axes."""
    random = generator(*axes, registered.pair.seed)
    return registered.twists_from(random.normal(size=(starts, 6)) * registered.deviation_6)


ESTIMATORS = {"monte_carlo": EstimatorEntry("Monte-Carlo", "starts", estimate)}
