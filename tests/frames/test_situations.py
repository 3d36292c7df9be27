import numpy as np
import pytest

from gpca.errors import InputError
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import LEAST_VISIBLE, Shelf, Situations, SituationSettings
from gpca.objects.camera import Camera, DepthNoise
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import inverse, rotation_angle_rad

from .tiny import scene_settings, surfaces

SETTINGS = SituationSettings(
    scenes=scene_settings(noise=DepthNoise(), objects=(3, 3), count=2, camera=Camera(160, 120, 285)), hidden=(0.3, 0.9)
)


@pytest.fixture(scope="module")
def shelf():
    return Shelf(surfaces(), "tiny", 1024, InitialPoseSettings(tries=2))


@pytest.fixture(scope="module")
def drawn(shelf):
    situations = Situations(shelf, SETTINGS, ("tiny", 0, "test"))
    return {cause: [situations.draw(cause, cause, n) for n in range(3)] for cause in CONCEPTS}


def test_a_situation_differs_from_the_one_without_the_cause_by_the_cause_alone(drawn):
    for noisy, clean in drawn["noise"]:
        low, high = SETTINGS.noise_scale
        assert low <= noisy.noise.scale <= high
        assert clean.noise.scale == 1
        assert noisy.standing == clean.standing
    for moved, clean in drawn["pose"]:
        assert moved.noise == clean.noise
        assert (clean.T_object_estimated == np.eye(4)).all()
        angle_deg = np.rad2deg(rotation_angle_rad(moved.T_object_estimated))
        length = np.linalg.norm(moved.T_object_estimated[:3, 3]) / moved.diameter_m
        assert 15 <= angle_deg <= 60
        assert length > 0
    for hidden, clean in drawn["overlap"]:
        assert len(hidden.standing) == len(clean.standing) + 1
        lost = 1 - hidden.visible().sum() / clean.visible().sum()
        assert 0.25 < lost < 0.95
        assert (hidden.T_object_estimated == np.eye(4)).all()


def test_the_object_is_in_sight_and_the_camera_looks_at_it(drawn):
    for _, clean in (pair for pairs in drawn.values() for pair in pairs):
        centre = inverse(clean.T_world_camera) @ clean.T_world_object[:, 3]
        assert centre[:2] == pytest.approx(0, abs=1e-9)
        low, high = SETTINGS.scenes.distance_m
        assert low <= centre[2] <= high
        assert clean.visible().sum() > 20 * LEAST_VISIBLE


def test_shots_depend_on_their_names_alone_and_more_frames_are_nearer_to_the_truth(drawn):
    situation, _ = drawn["noise"][0]
    a, b, other = (situation.shoot(situation.T_world_camera, 1, name) for name in ("a", "a", "b"))
    assert (a.depth_m == b.depth_m).all()
    assert (a.depth_m != other.depth_m).any()
    truth = situation.meshes.look(situation.camera, situation.T_world_camera).depth_m
    many = situation.shoot(situation.T_world_camera, 9, "a")

    def deviation(shot):
        both = shot.mask & (shot.depth_m > 0)
        return np.median(np.abs(shot.depth_m - truth)[both])

    assert deviation(many) < 0.6 * deviation(a)
    assert (a.mask == other.mask).all()


def test_parts_share_no_table_and_a_draw_does_not_depend_on_the_others(shelf, drawn):
    again = Situations(shelf, SETTINGS, ("tiny", 0, "test")).draw("overlap", "overlap", 2)[0]
    assert (again.T_world_camera == drawn["overlap"][2][0].T_world_camera).all()
    part = Situations(shelf, SETTINGS, ("tiny", 0, "train"))
    tables = [[p.T_world_object for p in s.draw("pose", "pose", 0)[1].standing] for s in (part,)]
    ours = [placed.T_world_object for pairs in drawn.values() for _, clean in pairs for placed in clean.standing]
    assert not any(np.array_equal(a, b) for table in tables for a in table for b in ours)


def test_the_estimator_is_off_by_the_pose_error_and_nothing_else(drawn):
    moved, clean = drawn["pose"][0]
    shot = clean.shoot(clean.T_world_camera, 1)
    points = shot.object_points_m(clean.diameter_m)
    off, right = moved.estimate(shot, points, "x"), clean.estimate(shot, points, "x")
    assert inverse(right) @ off == pytest.approx(moved.T_object_estimated)


def test_no_room_for_a_cause_and_ranges_that_run_downwards_are_refused(shelf):
    crowded = SituationSettings(scenes=scene_settings(objects=(5, 5)))  # the whole shelf is on the table
    with pytest.raises(InputError, match="no room for cause 'overlap'"):
        Situations(shelf, crowded, ("tiny", 0, "test")).draw("overlap", 0)
    with pytest.raises(InputError, match=r"hidden: \[0.9, 0.5\] is in descending order"):
        SituationSettings(hidden=(0.9, 0.5))
    with pytest.raises(InputError, match="cause 'fog': unknown"):
        Situations(shelf, SETTINGS, ("tiny", 0, "test")).draw("fog", 0)
