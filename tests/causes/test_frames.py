"""Instances whose answer is known: nothing wrong, hidden, misplaced, noisy; and those that have no answer."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.frames import chosen_starts, frame_candidate, measure_frames, subjects_of
from gpca.causes.settings import CauseSettings, FrameCauseSettings
from gpca.causes.truth import ALL, LARGEST_ERROR
from gpca.errors import InputError
from gpca.frames.dataset import meshes_of
from gpca.frames.instances import Starts
from gpca.frames.shots import clean_view
from gpca.objects.canonical import TRAINING
from tests.frames.bracket import BRACKET, hidden, misplaced, models_in, most_seen, noisy, own_starts

SETTINGS = CauseSettings(clean_pairs=20, points=(96, 128))
POINTS = 256


@pytest.fixture(scope="module")
def models(scenes):
    return models_in(scenes)


@pytest.fixture(scope="module")
def meshes(models, tiny):
    return meshes_of(models, tiny[1], range(len(tiny[1])))


@pytest.fixture(scope="module")
def seen(tiny):
    return most_seen(*tiny)


def measured(instances, objects, meshes):
    starts = own_starts(instances)
    return measure_frames(instances, starts, objects, meshes, "tiny", 100, SETTINGS, POINTS)


@pytest.mark.parametrize(("change", "cause"), [(hidden, "overlap"), (misplaced, "pose"), (noisy, "noise")])
def test_what_was_done_to_an_instance_is_its_cause(seen, tiny, meshes, change, cause):
    causes, table = measured(change(seen), tiny[1], meshes)
    assert causes.truth.dominant.tolist() == [cause]
    others = causes.truth.phi[0][np.array(["noise", "pose", "overlap"]) != cause]
    assert np.abs(others).max() < 0.5 * causes.truth.phi.max()
    assert table["dominant"].tolist() == [cause]
    assert causes.truth.phi.sum() == pytest.approx(causes.truth.error[0, ALL] - causes.truth.error[0, 0])


def test_nothing_is_wrong_with_what_is_whole_and_where_it_should_be(seen, tiny, meshes):
    causes, table = measured(seen, tiny[1], meshes)
    assert causes.truth.error[0, ALL] < SETTINGS.limits.nominal
    assert table[["rotation_rad", "translation"]].to_numpy() == pytest.approx(0, abs=1e-4)
    assert (table["noise"] < 0.005).all()  # the sensor is perfect, its image rounds
    again, _ = measured(seen, tiny[1], meshes)
    assert (again.truth.error == causes.truth.error).all()


def test_a_perfect_sensor_measures_what_is_rendered(seen, tiny, meshes):
    index = int(seen.object_index[0])
    surface_m = tiny[1].points(index).astype(float)
    view = clean_view(seen.sighting(0), seen.T_camera_object_true[0], meshes[index], surface_m)
    assert np.median(np.linalg.norm(view.measured - view.clean, axis=1)) < 1e-3
    whole = clean_view(hidden(seen).sighting(0), seen.T_camera_object_true[0], meshes[index], surface_m)
    assert whole.share == pytest.approx(view.share / 4, abs=0.05)
    assert len(whole.unmeasured) > len(view.unmeasured)
    assert np.isfinite(whole.clean).all()


def test_the_model_is_what_the_camera_would_see_where_icp_starts(seen, tiny, meshes):
    [subject] = subjects_of(seen, np.arange(1), tiny[1])
    T_init, random = misplaced(seen).T_camera_object_init[0], np.random.default_rng(100)
    candidate = frame_candidate(seen, 0, T_init, subject, meshes[subject.index], POINTS, random)
    assert candidate.reference((1,)) is candidate.model
    assert candidate.reference((0, 2)) is candidate.model_at_truth
    assert np.abs(candidate.model.mean(axis=0) - candidate.model_at_truth.mean(axis=0)).max() > 0.01


def test_what_has_no_mesh_or_lies_beside_it_is_refused_or_left_out(seen, tiny, models, meshes, capsys):
    without = {"tiny": {number: model for number, model in models["tiny"].items() if BRACKET not in model.surface.name}}
    with pytest.raises(InputError, match=f"object 'tiny {BRACKET}': has no mesh among the models"):
        meshes_of(without, tiny[1], seen.object_index.tolist())
    beside = replace(seen, points_m=seen.points_m + np.float32([5, 0, 0]))
    with pytest.raises(InputError, match="no instance in the frames can be measured"):
        measured(beside, tiny[1], meshes)
    assert "instance 0 (native, true_pose) is skipped: its pixels show none of the mesh" in capsys.readouterr().err


def test_what_finds_no_correspondence_failed_by_its_pose(seen, tiny, meshes):
    T_away = np.eye(4)
    T_away[0, 3] = 3.0
    away = replace(seen, T_camera_object_init=T_away @ seen.T_camera_object_true)
    causes, table = measured(away, tiny[1], meshes)
    assert table[["missed", "state", "dominant"]].to_numpy().tolist() == [[True, "failed", "pose"]]
    assert causes.truth.error[0, ALL] == LARGEST_ERROR
    assert (causes.inlier_rmse_runs == SETTINGS.icp.correspondence_distance).all()  # 0 would look like a perfect fit


def test_as_many_starts_are_drawn_of_each_kind_as_are_wanted_in_turns_of_the_scenes(tiny):
    instances = tiny[0]
    numbers = np.tile(np.arange(len(instances)), 2)
    kinds = np.repeat(["native", "ladder"], len(instances))
    starts = Starts(numbers, kinds, kinds, instances.T_camera_object_true[numbers])
    assert len(chosen_starts(starts, instances, "tiny", FrameCauseSettings())) == len(starts)
    some = chosen_starts(starts, instances, "tiny", FrameCauseSettings(starts=3))
    assert some.kind.tolist() == ["native"] * 3 + ["ladder"] * 3
    assert len(set(instances.scene[some.instance[:3]])) == min(3, len(set(instances.scene)))
    trained = replace(instances, fold=np.full(len(instances), TRAINING))
    assert len(chosen_starts(starts, trained, "tiny", FrameCauseSettings())) == 0
