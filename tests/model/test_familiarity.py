"""What is unlike the training raises a warning, and what is like it raises none."""

import json
from dataclasses import replace

import numpy as np
import pytest

from gpca import Explainer
from gpca.model.clouds import MEASURES, Familiarity, hidden_share, measure, voids_of
from gpca.model.diagnosis import ADVICE, CHECK, UNKNOWN
from gpca.objects.canonical import canonical_cloud
from gpca.objects.procedural import FAMILIES, surfaces

DIRECTIONS = np.random.default_rng(0).normal(size=(6, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
FAR = np.array([[9.0, 0, 0]])
PAIRS = {
    "a source elsewhere": (lambda s, t: (s + 5, t), "no source point ended near the target", "the initial pose"),
    "a source 4 times as large": (lambda s, t: (4 * s, t), "source and target differ in scale", "unit and scale"),
    "a source 6.5 times as large": (lambda s, t: (6.5 * s, t), "source and target differ in scale", "unit and scale"),
    "a source a seventh as large": (lambda s, t: (s / 7, t), "source and target differ in scale", "unit and scale"),
    "a far point in both": (lambda s, t: (np.r_[s, FAR], np.r_[t, FAR]), "98% of the target's points", "points far"),
}


def halves(points, diameter_m):
    """A target, and a source that shares no point with it, in diameters."""
    points = np.random.default_rng(3).permutation(points.astype(float)) / diameter_m
    return points[:2000], points[2000:]


@pytest.fixture(scope="module")
def shapes(four):
    """Target and source of stand-ins by name, but for the scissors, too thin to have a back."""
    from gpca.objects.canonical import canonical_cloud

    made = {
        name: halves(points, diameter_m)
        for name, diameter_m, (points, _) in zip(four.names, four.diameters_m, four.clouds, strict=True)
    }
    for surface in surfaces("linemod"):
        if surface.name in ("cat", "iron", "duck", "can"):
            points, _, diameter_m = canonical_cloud(surface, "linemod", 6000)
            made[surface.name] = halves(points, diameter_m)
    return {name: pair for name, pair in made.items() if "scissors" not in name}


UNSEEN = ("duck", "can")  # the others hold what a training should: an open vessel, a long thing, a flat one


@pytest.fixture(scope="module")
def clouds(shapes):
    return [pair for name, pair in shapes.items() if name not in UNSEEN]


@pytest.fixture(scope="module")
def unseen(shapes):
    return [shapes[name] for name in UNSEEN]


def visible(points, direction):
    """The points that a camera far away in that direction sees."""
    across = np.cross(direction, [0.3, 0.5, 0.8])
    picture = np.stack([points @ (across / np.linalg.norm(across)), points @ np.cross(direction, across)], axis=1)
    _, pixel = np.unique(np.floor(20 * picture).astype(int), axis=0, return_inverse=True)
    height = points @ direction
    foremost = np.full(pixel.max() + 1, -np.inf)
    np.maximum.at(foremost, pixel.ravel(), height)
    return points[height > foremost[pixel.ravel()] - 0.06]


def views(clouds):
    """What a camera sees of each object from each direction."""
    return [(visible(source, direction), target) for target, source in clouds for direction in DIRECTIONS]


def wholes(clouds):
    """Each object whole, and with a part cut off, noise added, or fewer points."""
    random, found = np.random.default_rng(1), []
    for target, source in clouds:
        along = source @ DIRECTIONS.T
        found += [(source[along[:, d] > np.quantile(along[:, d], q)], target) for d in range(6) for q in (0.1, 0.4)]
        noise = random.normal(size=source.shape)
        found += [(source, target), (source[:500], target), *((source + s * noise, target) for s in (0.01, 0.03))]
    return found


@pytest.fixture(scope="module")
def learnt(clouds):
    return {"views": Familiarity.of(views(clouds)), "wholes": Familiarity.of(wholes(clouds))}


def warned(familiarity, pairs):
    return [line for pair in pairs for line in familiarity.warnings(*pair)]


def test_half_of_a_sphere_is_hidden_and_little_of_one_side_of_it():
    sphere = np.random.default_rng(2).normal(size=(3000, 3))
    sphere /= 2 * np.linalg.norm(sphere, axis=1, keepdims=True)
    assert 0.35 < hidden_share(sphere) < 0.5
    assert hidden_share(sphere[sphere[:, 0] > 0]) < 0.2  # some of it only just faces the camera
    assert hidden_share(sphere * [1, 1, 0]) == 0
    measured = measure(0.5 * sphere, sphere)
    assert measured["size"] == pytest.approx(0.5)
    assert set(measured) == set(MEASURES)
    assert np.isnan(measure(sphere, sphere * [1, 1, 0])["depth"])


def test_good_input_of_shapes_that_were_not_learnt_raises_no_warning(learnt, unseen):
    assert warned(learnt["wholes"], wholes(unseen)) == []
    assert len(warned(learnt["views"], views(unseen))) <= 1  # of twelve, by as few as were learned


def test_whole_clouds_are_unlike_partial_views_and_the_other_way_round(learnt, clouds, unseen):
    for target, source in clouds + unseen:
        assert warned(learnt["views"], [(source, target)]) == [
            "the source shows the object from all sides, but GP-CA was trained on partial views"
        ]
    said = warned(learnt["wholes"], views(clouds + unseen))
    assert sum("from one side alone" in line for line in said) >= 0.7 * 42


def test_a_target_of_one_side_is_not_the_whole_object(learnt, clouds, unseen):
    said = warned(learnt["wholes"], [(seen, seen) for seen, _ in views(clouds + unseen)])
    assert sum("give the whole object" in line for line in said) >= 0.9 * 42


@pytest.mark.parametrize("scale", [0.3, 2.0, 3.0])
def test_another_scale_is_noticed(learnt, clouds, scale):
    for target, source in clouds:
        [line] = [line for line in warned(learnt["wholes"], [(scale * source, target)]) if "same unit" in line]
        assert float(line.split()[3]) == pytest.approx(scale, rel=0.1)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("threshold", [0.0, 2.0])  # of a model that calls everything failed, and nothing
def test_nothing_is_said_of_a_pair_without_meaning(name, threshold, model, pair):
    change, fault, check = PAIRS[name]
    diagnoser = replace(model.diagnoser, threshold=threshold)
    said = Explainer(replace(model, diagnoser=diagnoser), device="cpu").explain(*change(*pair))
    assert said.unknown
    assert (said.diagnosis.state, said.diagnosis.named, said.action) == (UNKNOWN, (), CHECK)
    assert check in said.reason
    assert any(line.startswith(fault) and "the scores are meaningless: check " in line for line in said.warnings)
    plain = json.loads(json.dumps(said.as_dict()))
    assert (plain["diagnosis"]["state"], plain["action"]) == ("unknown", "check")
    text = said.text()
    assert f"state     unknown\naction    {ADVICE[CHECK]} ({said.reason})\n" in text
    for word in ("nominal", "failed", "probability", "variance", "score "):
        assert word not in text


def test_gpca_alone_knows_nothing_of_such_a_pair_either(explainer, pair):
    source, target = pair
    said = explainer.explain(source + 5, target, diagnose=False)
    assert said.unknown
    assert said.action == CHECK
    assert "state     unknown" in said.text()


def test_what_can_be_judged_is_not_void(explainer, pair):
    source, target = pair
    for known in (source, 1.3 * source, source[: len(source) // 2], np.r_[source, [[0.3, 0, 0]]]):
        assert not explainer.explain(known, target).unknown
    near = source / np.linalg.norm(np.ptp(source, axis=0))
    (void,) = voids_of(near, near, 2 / len(near), None)
    assert str(void).startswith("only 2 of the source's points ended near the target, so")
    assert voids_of(near, near, 3 / len(near), None) == []


@pytest.mark.parametrize("family", FAMILIES)
def test_the_diameter_of_no_object_is_made_up_of_a_few_points(family):
    for surface in surfaces(family):
        points, _, diameter_m = canonical_cloud(surface, family, 2048)
        assert voids_of(points / diameter_m, points / diameter_m, 1.0, None) == []
