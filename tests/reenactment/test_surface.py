import numpy as np
import pytest

from gpca.alignment.pose_error import PoseErrors
from gpca.reenactment.surface import CORNER, ModelSurface, covered_points
from gpca.rigid import exp, transform


def test_planes_lie_in_the_surface(drill, model):
    others = drill[400:1000]
    residuals, rows = model.residuals(others)
    nearest = np.linalg.norm(model.points[:, None] - others, axis=2)
    assert np.array_equal(rows, nearest.argmin(axis=0))
    assert np.median(np.abs(residuals)) < 0.5 * np.median(nearest.min(axis=0))
    assert np.abs((model.normals[:, None] * model.tangents).sum(axis=2)).max() < 1e-9


def test_errors_are_add_where_nothing_is_symmetric(drill, model):
    poses = exp(np.random.default_rng(100).normal(scale=0.1, size=(6, 6)))
    assert not model.symmetric
    assert model.errors(poses) == pytest.approx(PoseErrors(model.points, 256, symmetric=False)(poses))


def test_a_can_turned_about_its_axis_is_where_it_was_and_poses_are_as_far_apart_as_their_surfaces(can, drill):
    surface = ModelSurface(can[:200])
    turned = exp(np.array([[0, 0, 1.0, 0, 0, 0], [1.0, 0, 0, 0, 0, 0]]))
    assert surface.symmetric
    nearest = PoseErrors(surface.points, 200, symmetric=True)(turned)
    found = surface.errors(turned)
    assert found[0] < 0.3 * nearest[0]
    assert found[1] > 0.05
    turned = exp(np.array([[0, 0, 1.0, 0, 0, 0]]))
    assert ModelSurface(can[:400]).apart(turned)[0] < 0.012
    assert ModelSurface(drill[:400]).apart(turned)[0] > 0.05


def surface_of_boxes(*sizes_and_centers, count=400):
    """Points spread evenly over boxes, each by its size and center."""
    random, parts = np.random.default_rng(100), []
    for size, center in sizes_and_centers:
        points = random.uniform(-0.5, 0.5, size=(count * 6, 3)) * size
        axis, side = random.integers(3, size=len(points)), random.choice([-0.5, 0.5], size=len(points))
        points[np.arange(len(points)), axis] = side * np.array(size)[axis]
        parts.append(points[: round(count * np.prod(size) ** (2 / 3) / 0.08)] + center)
    return random.permutation(np.concatenate(parts))


BOX = ((0.3, 0.5, 0.75), (0, 0, 0))
SLIDE, OVER = exp(np.array([[0, 0, 0, 0, 0, 0.1], [np.pi, 0, 0, 0, 0, 0]]))


def test_up_to_symmetry_a_box_that_slides_along_itself_is_as_wrong_as_it_slides():
    surface = ModelSurface(surface_of_boxes(BOX))
    poses = np.array([np.eye(4), SLIDE, OVER, SLIDE @ OVER])
    assert surface.symmetric
    assert surface.errors(poses).max() < 0.04
    assert surface.errors_up_to_symmetry(poses) == pytest.approx([0, 0.1, 0, 0.1], abs=1e-9)


def test_up_to_symmetry_a_can_may_turn_and_not_slide(can, drill, model):
    surface, turned = ModelSurface(can[:400]), exp(np.array([[0, 0, 1.0, 0, 0, 0], [0, 0, 1.0, 0, 0, 0.1]]))
    assert surface.errors_up_to_symmetry(turned) == pytest.approx([0, 0.1], abs=1e-9)
    assert np.array_equal(model.errors_up_to_symmetry(turned), model.errors(turned))


def test_up_to_symmetry_a_knob_counts_that_distances_hardly_see():
    knobbed = ModelSurface(surface_of_boxes(BOX, ((0.12, 0.12, 0.12), (0.21, 0, 0.3))))
    assert knobbed.symmetric
    assert knobbed.errors_up_to_symmetry(OVER[None])[0] > 0.2


def test_distances_are_those_from_planes_within_reach_and_count_as_errors_beyond(drill, model):
    points = drill[400:500] + np.random.default_rng(1).normal(scale=0.03, size=(100, 3))
    rows = np.linalg.norm(model.points[:, None] - points, axis=2).argmin(axis=0)
    offsets = points - model.points[rows]
    square, off = (offsets**2).sum(axis=1), (offsets * model.normals[rows]).sum(axis=1)
    along = np.maximum(np.sqrt(np.maximum(square - off**2, 0)) - CORNER * model.spacing_M[rows], 0)
    assert model.distances(points) == pytest.approx(np.minimum(np.hypot(off, along), np.sqrt(square)), abs=1e-9)
    far = np.array([[5.0, 0, 0], [0.1, 0, 0]])
    nearest = np.linalg.norm(model.points[:, None] - far, axis=2).argmin(axis=0)
    assert np.array_equal(model.residuals(far)[1], nearest)
    assert model.distances(np.array([[5.0, 0, 0]]))[0] == 0.5


def seen(points, share, along):
    order = np.argsort(points @ along)
    return points[order[: round(len(points) * (1 - share))]]


def covered(model, observed, noise, seed=0):
    return covered_points(model, observed, noise, np.random.default_rng(seed))


@pytest.mark.parametrize("share", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("noise", [0.0, 0.03, 0.06])
def test_the_missing_share_is_found_whatever_the_noise(drill, model, share, noise):
    random = np.random.default_rng(3)
    found = []
    for along in random.normal(size=(6, 3)):
        observed = seen(drill[400:1200], share, along / np.linalg.norm(along))
        found.append(
            1 - covered(model, observed + random.normal(scale=max(noise, 1e-9), size=observed.shape), noise).mean()
        )
    assert np.mean(found) == pytest.approx(share, abs=0.07)
    assert np.abs(np.array(found) - share).max() < 0.2


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_nothing_is_missing_of_a_whole_surface(drill, model, noise):
    observed = drill[400:900] + np.random.default_rng(4).normal(scale=max(noise, 1e-9), size=(500, 3))
    assert covered(model, observed, noise).all()


def test_the_side_that_is_missing_is_the_one_that_was_cut_off(drill, model):
    along = np.array([1.0, 0, 0])
    is_covered = covered(model, seen(drill[400:1200], 0.5, along), 0.0)
    limit = np.median(model.points @ along)
    assert (is_covered == (model.points @ along <= limit)).mean() > 0.9


def test_a_pose_that_differs_in_a_part_alone_is_another_and_its_turn_no_symmetry(can):
    handle = np.array([0.5, 0.0, 0.2]) + np.random.default_rng(0).uniform(-0.06, 0.06, size=(700, 3))
    mug = ModelSurface(np.random.default_rng(1).permutation(np.concatenate([can[:4000], handle]))[:400])
    half = exp(np.array([[0, 0, np.pi, 0, 0, 0]]))
    moved = mug.distances(transform(half[0], mug.points))
    assert moved.mean() < 0.05 < mug.apart(half)[0]
    assert ModelSurface(can[:400]).symmetric and not mug.symmetric


def test_a_partial_can_is_completed_by_what_was_observed(can):
    is_left = can @ np.array([1.0, 0.3, 0.5]) < 0.05
    partial, lacking = ModelSurface(can[:1200][is_left[:1200]]), can[1200:2400][~is_left[1200:2400]]
    turned = exp(np.array([[0, 0, 1.0, 0, 0, 0]]))
    whole = partial.completed(lacking, 0.0)
    assert not partial.symmetric and whole.symmetric
    assert whole.errors(turned)[0] < 0.02 < partial.errors(turned)[0]
