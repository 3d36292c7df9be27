"""Pairs of scans, what is common to both, and the error over that."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.rigid import rigid_motion, transform
from gpca.errors import InputError
from gpca.scans.pair import OVERLAP_M, ScanSuccess, overlap_rmse

from .tiny import floor, pair


def test_common_points_are_those_that_the_other_scan_has_too():
    scans = pair()
    x_N = transform(scans.T_target_source, scans.source_N_3)[:, 0]  # the target's frame is the scene's, but for z
    assert scans.source_common_N[x_N < 0.98].all() and not scans.source_common_N[x_N > 1 + OVERLAP_M].any()
    x_M = scans.target_M_3[:, 0]
    assert scans.target_common_M[x_M > 0.5].all() and not scans.target_common_M[x_M < 0.5 - OVERLAP_M].any()


def test_an_object_has_the_lengths_of_a_room_in_proportion():
    scans = pair("object")
    extent = np.ptp(floor(0.0, 1.8), axis=0)
    assert scans.size_m == pytest.approx(np.linalg.norm(extent), rel=1e-6)
    assert scans.scale == pytest.approx(scans.size_m / 3)
    assert scans.overlap_m == pytest.approx(OVERLAP_M * scans.size_m / 3)
    assert (pair().scale, pair().overlap_m) == (1, OVERLAP_M)
    assert scans.cluster == "floor" and replace(scans, family="floors").cluster == "floors"


def test_the_error_is_that_of_the_common_points_alone():
    scans = pair()
    assert overlap_rmse(scans, scans.T_target_source) == 0
    moved = rigid_motion(np.eye(3), (0.03, 0.04, 0.0)) @ scans.T_target_source
    assert overlap_rmse(scans, moved) == pytest.approx(0.05)
    # A turn about the middle of the common points moves these by their distances from its axis.
    angle, common_n_3 = 0.1, transform(scans.T_target_source, scans.source_N_3[scans.source_common_N])
    middle_3 = common_n_3.mean(axis=0)
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turned = rigid_motion(R, middle_3 - R @ middle_3) @ scans.T_target_source
    radii_n = np.linalg.norm((common_n_3 - middle_3)[:, :2], axis=1)
    assert overlap_rmse(scans, turned) == pytest.approx(2 * np.sin(angle / 2) * np.sqrt(np.square(radii_n).mean()))


def test_limits_are_absolute_in_rooms_and_relative_for_objects():
    limits = ScanSuccess(room_m=0.2, object_share=0.02)
    assert limits.limit_m(pair()) == 0.2
    assert limits.limit_m(pair("object")) == pytest.approx(0.02 * pair("object").size_m)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"source_N_3": np.zeros((2, 3))}, r"scan '1' of floor: has shape \(2, 3\)"),
        ({"target_M_3": np.full((9, 3), np.nan)}, "scan '0' of floor: has shape .* or contains NaN"),
        ({"T_target_source": 2 * np.eye(4)}, "pose of 1 in 0, floor: the pose is not a rigid transform"),
        ({"size_m": 0.0}, "scene floor: has no extent"),
    ],
)
def test_what_is_no_pair_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        replace(pair(), **changes)
