"""Frames whose answer is known, re-enacted by an observer who knows the mesh and the camera, but not the pose."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import observed_pair
from gpca.causes.frames import measure_frames, subjects_of
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import ALL, shapley_values
from gpca.errors import InputError
from gpca.frames.dataset import meshes_of
from gpca.reenactment.dataset import Reenactments
from gpca.reenactment.frames import FrameView, KnownObject, reenact_frames
from gpca.reenactment.settings import ReenactmentSettings
from gpca.rigid import inverse, rotation_angle_rad, scale_translation
from tests.frames.bracket import hidden, misplaced, models_in, most_seen, noisy, own_starts
from tests.reenactment.conftest import without_truth

NUMBERS = set(Reenactments.array_fields()) - {"sample", "split"}

TRUTH = CauseSettings(clean_pairs=20, points=(96, 128))
SETTINGS = ReenactmentSettings(3, good_starts=0.7, good_rotation_deg=8, good_translation=0.05, lost_starts=0.01)
POINTS = 256


@pytest.fixture(scope="module")
def objects(tiny):
    return tiny[1]


@pytest.fixture(scope="module")
def meshes(scenes, objects):
    return meshes_of(models_in(scenes), objects, range(len(objects)))


@pytest.fixture(scope="module")
def seen(tiny):
    return most_seen(*tiny)


def measured(instances, objects, meshes):
    return measure_frames(instances, own_starts(instances), objects, meshes, "tiny", 100, TRUTH, POINTS)[0]


def enacted(causes, instances, objects, meshes):
    return reenact_frames(causes, own_starts(instances), instances, objects, meshes, SETTINGS, TRUTH)


def whole(seen):
    return seen


def off(seen):
    """From a start that is off by so little that ICP corrects it."""
    T_off = np.eye(4)
    T_off[:3, 3] = 0.004
    return replace(seen, T_camera_object_init=seen.T_camera_object_true @ T_off)


@pytest.mark.parametrize(
    ("change", "cause"),
    [(whole, "nominal"), (off, "nominal"), (hidden, "overlap"), (misplaced, "pose"), (noisy, "noise")],
)
def test_what_is_wrong_is_named_without_the_truth(seen, objects, meshes, change, cause):
    instances = change(seen)
    causes = measured(instances, objects, meshes)
    found = enacted(causes, instances, objects, meshes)
    assert found.verdict.sum(axis=1) == pytest.approx(1)
    # The noise of one bracket is borderline, and so may be called nominal.
    named = found.verdict[0].argmax() if cause == "nominal" else 1 + found.verdict[0, 1:].argmax()
    assert LABELS[named] == cause
    assert found.error[0, 0, ALL] == pytest.approx(causes.truth.error[0, ALL], abs=0.05)
    phi = shapley_values((found.weight[..., None] * found.error).sum(axis=1))
    assert np.abs(phi - causes.truth.phi).max() < 0.15


def test_the_best_hypothesis_is_the_true_pose(seen, objects, meshes):
    instances = misplaced(seen)
    causes = measured(instances, objects, meshes)
    T = enacted(causes, instances, objects, meshes).T_model_observed[0, 0]
    T_true = inverse(instances.T_camera_object_true[0]) @ instances.T_camera_object_init[0]
    T_off = T @ inverse(scale_translation(T_true, 1 / objects.diameters_m[instances.object_index[0]]))
    assert np.rad2deg(rotation_angle_rad(T_off)) < 5
    assert np.linalg.norm(T_off[:3, 3]) < 0.03


def test_nothing_that_only_the_truth_knows_is_read(seen, objects, meshes):
    instances = hidden(misplaced(seen))
    instances = replace(instances, T_camera_object_init=misplaced(seen).T_camera_object_init)
    causes = measured(instances, objects, meshes)
    without = without_truth(causes)
    nowhere = replace(instances, T_camera_object_true=instances.T_camera_object_true * np.nan)
    nowhere = replace(nowhere, T_camera_object_init=nowhere.T_camera_object_true, init_from=np.array(["nobody"]))
    first = enacted(causes, instances, objects, meshes)
    again = reenact_frames(without, own_starts(instances), nowhere, objects, meshes, SETTINGS, TRUTH)
    for name in NUMBERS:
        assert np.array_equal(getattr(first, name), getattr(again, name)), name


def test_where_nothing_of_the_mesh_is_in_sight_only_a_pose_error_is_taken_away(seen, objects, meshes):
    causes = measured(seen, objects, meshes)
    [subject] = subjects_of(seen, np.arange(1), objects)
    pair = observed_pair(causes, 0, "tiny", 100)
    known = KnownObject(subject, meshes[subject.index])
    view = FrameView(pair, known, seen.camera_3_3[0], seen.pixels_of(0), seen.T_camera_object_init[0])
    T_beside = np.eye(4)
    T_beside[0, 3] = 4.0
    candidate = view.candidate(T_beside, np.random.default_rng(100))
    assert candidate.severity["noise"] == candidate.severity["crop"] == 0
    assert np.array_equal(candidate.clean, candidate.noisy)
    behind = np.eye(4)
    behind[2, 3] = 50.0  # takes what was observed so far along the camera's axis as to leave the model behind it
    for T in (T_beside, behind, inverse(behind)):
        assert np.isfinite(view.candidate(T, np.random.default_rng(100)).model_at_truth).all()


def test_starts_of_other_registrations_are_refused(seen, objects, meshes):
    causes = measured(seen, objects, meshes)
    starts = own_starts(seen)
    none = starts.subset(np.arange(0))
    with pytest.raises(InputError, match="are of other registrations than the causes"):
        reenact_frames(causes, none, seen, objects, meshes, SETTINGS, TRUTH)
