import numpy as np
import pytest

from gpca.alignment.rigid import inverse, rotation_angle_rad, transform
from gpca.scans.ladder import Rung, disturbed

from .tiny import pair


@pytest.mark.parametrize("kind", ["room", "object"])
def test_a_start_is_off_by_its_rung(kind):
    scans, rung = pair(kind), Rung(40, 0.5)
    T = disturbed(scans, rung, "tiny", 0)
    assert rotation_angle_rad(T @ inverse(scans.T_target_source)) == pytest.approx(np.deg2rad(40))
    middle_3 = scans.source_N_3.mean(axis=0)
    shift_3 = transform(T, middle_3) - transform(scans.T_target_source, middle_3)
    assert np.linalg.norm(shift_3) == pytest.approx(0.5 * scans.scale)


def test_the_lowest_rung_is_the_truth_and_draws_are_named():
    scans = pair()
    np.testing.assert_allclose(disturbed(scans, Rung(0, 0), "tiny", 0), scans.T_target_source, atol=1e-12)
    first, again, other = (disturbed(scans, Rung(10, 0.1), "tiny", seed) for seed in (0, 0, 1))
    assert (first == again).all() and not np.allclose(first, other)
    assert Rung(10, 0.25).name == "10deg_0.25m"
