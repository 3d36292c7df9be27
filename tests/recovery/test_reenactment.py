"""A robot's re-enactment of its own registration."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.causes.truth import ALL, NONE
from gpca.frames.shots import Shot
from gpca.objects.camera import Camera, MeshScene
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.actions import ACTIONS, Robot
from gpca.recovery.episodes import register_after
from gpca.recovery.reenactment import KnownModel, appearance, believe, reenact, seen_surface
from gpca.reenactment.settings import ReenactmentSettings
from gpca.rigid import inverse, rigid_motion, scale_translation
from tests.failures import LOOP

SETTINGS, COUNTERFACTUALS = ReenactmentSettings(), CauseSettings(moved=OBSERVED)
AXES = ("tiny", 1)


@pytest.fixture(scope="module")
def known(start):
    return KnownModel.of(Robot(start[0]), np.random.default_rng(0))


def belief_of(holding, known, axes=AXES):
    return believe(holding, known, SETTINGS, COUNTERFACTUALS, axes)


def right(start):
    situation, outcome = start
    pose = situation.T_world_object
    return replace(outcome.holding, T_world_object_init=pose, T_world_object=pose)


def test_a_wrong_pose_is_probably_a_failure_and_a_right_one_is_not(start, known):
    wrong = belief_of(start[1].holding, known)
    assert wrong.failure > 0.9
    assert belief_of(right(start), known).failure < 0.1
    assert wrong.weight_K.sum() == pytest.approx(1)
    assert (wrong.error_K > 0.1).all()


def test_a_bad_start_is_what_adds_most(start, known):
    holding = start[1].holding
    reenacted = reenact(belief_of(holding, known), holding, known, COUNTERFACTUALS, AXES)
    assert CONCEPTS[reenacted.phi_3.argmax()] == "pose"
    error_8 = reenacted.error_K_8[0]
    assert error_8[ALL] > 0.1 > error_8[NONE]
    assert reenacted.seconds > reenacted.belief.seconds > 0
    # Hypotheses under which the pose is right say nothing of a failure.
    doubled = replace(
        reenacted,
        belief=replace(reenacted.belief, weight_K=np.array([0.1, 0.9]), failure_K=np.array([1.0, 1e-6])),
        error_K_8=np.array([np.where(np.arange(8) & 1, 0.2, 0.0), np.where(np.arange(8) & 2, 0.2, 0.0)]),
    )
    assert doubled.phi_3 == pytest.approx([0.2, 0, 0], abs=1e-4)


def test_it_reads_what_the_robot_holds_and_the_model_alone(start):
    """A robot without a situation, so without a truth, comes to the same numbers."""
    situation, outcome = start
    robot = Robot(situation)
    shape = ("points_m", "normals", "vertices_m", "faces", "diameter_m")
    bare = SimpleNamespace(**{name: getattr(robot, name) for name in shape})
    numbers = []
    for who in (robot, bare):
        known = KnownModel.of(who, np.random.default_rng(0))
        belief = belief_of(outcome.holding, known)
        numbers.append((belief.failure, reenact(belief, outcome.holding, known, COUNTERFACTUALS, AXES).error_K_8))
    assert numbers[0][0] == numbers[1][0]
    assert np.array_equal(numbers[0][1], numbers[1][1])


def test_seen_surface_faces_a_camera_and_grows_with_another_view(start, known):
    situation, outcome = start
    action = ACTIONS["new_view"]
    twice = register_after(situation, outcome, action, ("new_view",), LOOP).holding
    shares = []
    for holding in (outcome.holding, twice):
        T_true = scale_translation(
            inverse(situation.T_world_object) @ holding.T_world_object_init, 1 / situation.diameter_m
        )
        seen_M = seen_surface(holding, known, SimpleNamespace(T=T_true), 0.0)
        shares.append(seen_M.mean())
    assert 0.1 < shares[0] < 0.6
    assert shares[1] > shares[0]


CAMERA = Camera(80, 80, 80)
REACH_M = 0.01


def at(x_m, z_m):
    return rigid_motion(np.eye(3), (x_m, 0.0, z_m))


@pytest.fixture(scope="module")
def cube():
    import trimesh

    box = trimesh.creation.box((0.4, 0.4, 0.4))
    return MeshScene([(box.vertices, box.faces)])


def shot_of(cube, T_camera_object, hidden_to=0):
    """The cube before a wall at 3 m, its left columns behind something at 0.5 m; the camera is the world."""
    view = cube.look(CAMERA, np.linalg.inv(T_camera_object))
    is_object = np.isfinite(view.depth_m)
    depth_m = np.where(is_object, view.depth_m, 3.0)
    depth_m[:, :hidden_to], is_object[:, :hidden_to] = 0.5, False
    return Shot(CAMERA, np.eye(4), depth_m, is_object)


def test_the_true_pose_explains_all_others_the_less_and_what_stands_in_front_says_nothing(cube):
    explained = appearance([shot_of(cube, at(0, 1))], cube)
    shares = [explained(at(x_m, 1), REACH_M) for x_m in (0, 0.1, 0.2, 2)]
    assert shares[0] == 1
    assert shares == sorted(shares, reverse=True) and shares[-1] == 0
    assert explained(at(0, 1.1), REACH_M) == 0  # behind what was measured: it would be elsewhere
    assert explained(at(0, 1.1), 0.2) > 0.8
    explained = appearance([shot_of(cube, at(0, 1), hidden_to=40)], cube)
    assert explained(at(0, 1), REACH_M) == 1
    assert explained(at(0.2, 1), REACH_M) < 0.8  # there the camera looks through it at the wall
