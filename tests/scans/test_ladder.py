import numpy as np
import pytest

from gpca.alignment.rigid import inverse, rotation_angle_rad, transform
from gpca.scans.pair import Rung, disturbed, rungs_of

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


def test_pairs_in_a_row_are_on_different_rungs_whose_order_is_drawn():
    ladder = [Rung(10 * i, 0) for i in range(5)]
    rungs = rungs_of(23, ladder, "tiny", 0)
    blocks = [tuple(rung.rotation_deg for rung in rungs[i : i + 5]) for i in range(0, 20, 5)]
    assert all(sorted(block) == [0, 10, 20, 30, 40] for block in blocks) and len(set(blocks)) > 1
    assert rungs_of(8, ladder, "tiny", 0) == rungs[:8] != rungs_of(8, ladder, "tiny", 1)
