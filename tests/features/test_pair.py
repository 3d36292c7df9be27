import numpy as np
import pytest

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.features.pair import observed_pair


def test_a_pair_lies_where_icp_put_it_and_knows_the_way_back(causes):
    row = int(causes.rows("test")[0])
    seen, registrations = observed_pair(causes, row, "four"), causes.registrations
    assert np.array_equal(seen.model, registrations.target(row))
    assert seen.T_runs[0] == pytest.approx(np.eye(4), abs=1e-9)
    diameter_m = registrations.diameter_m[row]
    T_icp = scale_translation(registrations.T_target_source_icp[row], 1 / diameter_m)
    started = transform(inverse(T_icp), seen.observed)
    assert transform(seen.T_init, seen.observed) == pytest.approx(started, abs=1e-9)
    other = scale_translation(causes.T_target_source_runs[row, 3], 1 / diameter_m)
    assert transform(seen.T_runs[3], seen.observed) == pytest.approx(transform(other, started), abs=1e-9)
