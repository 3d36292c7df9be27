import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gpca.reenactment.hypotheses import rotations, search_starts


@pytest.mark.parametrize(("count", "largest_deg", "gap_deg"), [(48, 109.0, 45), (24, 180.0, 75)])
def test_rotations_of_every_size_have_one_near_by(count, largest_deg, gap_deg):
    spread = rotations(count, largest_deg)
    assert len(spread) == pytest.approx(count, rel=0.25)
    assert np.rad2deg(Rotation.from_matrix(spread).magnitude()).max() <= largest_deg + 1e-6
    drawn = Rotation.random(300, np.random.default_rng(0))
    drawn = drawn[drawn.magnitude() < np.deg2rad(largest_deg)]
    nearest = [(Rotation.from_matrix(spread) * turn.inv()).magnitude().min() for turn in drawn]
    assert np.rad2deg(np.quantile(nearest, 0.95)) < gap_deg


def test_starts_begin_with_the_initial_pose_and_lay_centers_on_each_other():
    random = np.random.default_rng(0)
    observed, model = random.normal(size=(50, 3)) + 3, random.normal(size=(60, 3))
    starts = search_starts(observed, model)
    assert np.array_equal(starts[0], np.eye(4))
    centers = starts[:, :3, :3] @ observed.mean(axis=0) + starts[:, :3, 3]
    on_center = np.isclose(centers, model.mean(axis=0)).all(axis=1)
    about_origin = (starts[:, :3, 3] == 0).all(axis=1)
    assert (on_center | about_origin).all() and on_center.sum() > about_origin.sum() > 10
