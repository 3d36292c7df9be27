"""What is unlike the training raises a warning, and what is like it raises none."""

import numpy as np
import pytest

from gpca.model.familiarity import MEASURES, Familiarity, hidden_share, measure

DIRECTIONS = np.random.default_rng(0).normal(size=(4, 3))


@pytest.fixture(scope="module")
def clouds(four):
    """Target, whole source and normals of each object but the scissors, which are too thin to have a back."""
    found = []
    for name, diameter_m, (points, normals) in zip(four.names, four.diameters_m, four.clouds, strict=True):
        if "scissors" not in name:
            points = points.astype(float) / diameter_m
            found.append((points[:2000], points[2000:4000], normals[2000:4000]))
    return found


def views(clouds):
    """What a camera sees of each object from each direction: the points whose normals face it."""
    return [(source[normals @ direction > 0], target) for target, source, normals in clouds for direction in DIRECTIONS]


def wholes(clouds):
    """Each object whole, and with a part cut off, noise added, or fewer points."""
    random, found = np.random.default_rng(1), []
    for target, source, _ in clouds:
        for direction in DIRECTIONS:
            along = source @ direction
            found += [(source[along > np.quantile(along, share)], target) for share in (0.1, 0.4)]
        noise = random.normal(size=source.shape)
        found += [(source, target), (source[:500], target), *((source + s * noise, target) for s in (0.01, 0.03))]
    return found


@pytest.fixture(scope="module")
def learnt(clouds):
    return {"views": Familiarity.of(views(clouds)), "wholes": Familiarity.of(wholes(clouds))}


def test_half_of_a_sphere_is_hidden_and_nothing_of_one_side_of_it():
    sphere = np.random.default_rng(2).normal(size=(3000, 3))
    sphere /= 2 * np.linalg.norm(sphere, axis=1, keepdims=True)
    assert 0.35 < hidden_share(sphere) < 0.5
    assert hidden_share(sphere[sphere[:, 0] > 0]) < 0.05
    assert hidden_share(sphere * [1, 1, 0]) == 0
    measured = measure(0.5 * sphere, sphere)
    assert measured["size"] == pytest.approx(0.5)
    assert set(measured) == set(MEASURES)
    assert np.isnan(measure(sphere, sphere * [1, 1, 0])["depth"])


def shapes_unseen():
    """Objects of another family than the training's."""
    from gpca.objects.canonical import canonical_cloud
    from gpca.objects.procedural import surfaces

    found = []
    for surface in (each for each in surfaces("linemod") if each.name in ("duck", "can")):
        points, normals, diameter_m = canonical_cloud(surface, surface.name, 4000)
        order = np.random.default_rng(3).permutation(4000)
        points, normals = points[order].astype(float) / diameter_m, normals[order]
        found.append((points[:2000], points[2000:], normals[2000:]))
    return found


def test_good_input_of_shapes_that_were_not_learnt_raises_no_warning(learnt):
    unseen = shapes_unseen()
    assert [learnt["views"].warnings(*pair) for pair in views(unseen)] == [[]] * 8
    assert [learnt["wholes"].warnings(*pair) for pair in wholes(unseen)] == [[]] * 24


def test_whole_clouds_are_unlike_partial_views_and_the_other_way_round(learnt, clouds):
    for target, source, _ in clouds:
        assert learnt["views"].warnings(source, target) == [
            "the source shows the object from all sides, but GP-CA learnt partial views"
        ]
    said = [line for pair in views(clouds) for line in learnt["wholes"].warnings(*pair)]
    assert sum("from one side alone" in line for line in said) >= 10  # of twelve


def test_a_target_of_one_side_is_not_the_whole_object(learnt, clouds):
    for pair in views(clouds):
        seen, _ = pair
        assert any("give the whole object" in line for line in learnt["wholes"].warnings(seen, seen))


@pytest.mark.parametrize("scale", [0.3, 2.0, 2.54])
def test_another_scale_is_noticed(learnt, clouds, scale):
    for target, source, _ in clouds:
        [line] = [line for line in learnt["wholes"].warnings(scale * source, target) if "same unit" in line]
        assert line.startswith(f"the source is {scale:.1g}"[:19])
