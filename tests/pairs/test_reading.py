import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.errors import InputError
from gpca.pairs.synthesis import read_as


def test_readings_are_before_icp_after_it_and_after_icp_from_the_model(registrations):
    few = registrations.subset(np.arange(3))
    assert read_as("aligned", few, ICPSettings()) is few
    observed, backwards = (read_as(name, few, ICPSettings()) for name in ("observed", "reversed"))
    for row in range(3):
        assert np.allclose(observed.cloud(row), few.source(row), atol=1e-5)
        assert np.allclose(observed.source(row), few.source(row), atol=1e-5)
        assert np.array_equal(observed.target(row), few.target(row))
        assert not np.array_equal(backwards.cloud(row), few.cloud(row))
    with pytest.raises(InputError, match="reading 'sideways': unknown; choose one of aligned, observed, reversed"):
        read_as("sideways", few, ICPSettings())
