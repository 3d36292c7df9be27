"""A pair of clouds of one surface, lying on each other unless a test moves them."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.causes.settings import DescriptorSettings
from gpca.pairs.distances import ObservedPair

FEW = DescriptorSettings(starts=2, restarts=4, icp_points=128)
ICP = ICPSettings()


@pytest.fixture(scope="session")
def pair(four):
    """Of a power drill, registered perfectly from everywhere."""
    index = four.row("035_power_drill")
    surface = four.points(index).astype(float) / four.diameters_m[index]
    still = np.tile(np.eye(4), (13, 1, 1))
    return ObservedPair(surface[:300], surface[300:600], np.eye(4), still, np.ones(13), np.full(13, 0.02), ("tiny",))


def moved(pair, offset):
    return replace(pair, observed=pair.observed + np.array(offset))
