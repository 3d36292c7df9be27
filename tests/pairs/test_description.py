from dataclasses import replace

import numpy as np
import pytest

from gpca.pairs.description import WIDTHS, describe_registrations


@pytest.fixture(scope="module")
def few(registrations):
    return registrations.subset(np.arange(12))


def described(registrations, **changes):
    return describe_registrations(replace(registrations, **changes), "tiny", 100, points=128)


def test_every_group_has_its_width_and_is_finite(few):
    groups = described(few)
    shapes = {name: (12, width) for name, width in WIDTHS.items()} | {"points": (12, 2, 128, 7)}
    assert {name: array.shape for name, array in groups.items()} == shapes
    assert all(np.isfinite(array).all() for array in groups.values())


def test_relations_do_not_depend_on_the_objects_size(few):
    """All lengths of a pair twice as large: its distances are twice as large, its relations as before."""
    scaled = {name: 2 * getattr(few, name) for name in ("points", "target_points", "inlier_rmse")}
    twice, once = described(few, **scaled), described(few)
    assert twice["distances"] == pytest.approx(2 * once["distances"], rel=1e-4)
    assert twice["relations"][:, :30] == pytest.approx(once["relations"][:, :30], rel=1e-3, abs=1e-3)
    assert twice["densities"] == pytest.approx(once["densities"], abs=1e-4)


def test_the_motion_is_that_from_the_initial_pose(few):
    moved = described(few)["relations"][:, 30:33]
    still = described(few, T_target_source_icp=few.T_target_source_init)["relations"][:, 30:33]
    assert (moved[few.concept == "pose", 0] > 0.05).all()  # radians
    assert still == pytest.approx(np.zeros((12, 3)), abs=1e-6)
