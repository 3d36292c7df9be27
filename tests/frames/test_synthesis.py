from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.frames.instances import Instances
from gpca.frames.synthesis import HALF_SPACE, OCCLUDER, TOLERANCE, FrameSettings, make_frame_registrations, occlude
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import RegistrationSettings
from gpca.rigid import inverse, transform

SETTINGS = FrameSettings(registration=RegistrationSettings(train=24, test=12, cloud_points=256))


@pytest.fixture(scope="module")
def made(tiny):
    return make_frame_registrations(*tiny, "tiny", 0, SETTINGS)


def test_concepts_are_balanced_and_no_scene_is_in_training_and_test(tiny, made):
    instances, _ = tiny
    registrations, seconds_S, poses = made
    for split, count in (("train", 24), ("test", 12)):
        rows = registrations.rows(split)
        assert [np.sum(registrations.concept[rows] == c) for c in CONCEPTS] == [count // 3] * 3
    shown = [poses.loc[poses["split"] == split] for split in ("train", "test")]
    scenes = [set(instances.scene[rows["instance"]]) for rows in shown]
    assert not scenes[0] & scenes[1]
    assert (poses["in_training"] == poses["object"].isin(shown[0]["object"])).all()
    assert len(seconds_S) == len(registrations) == len(poses)
    assert (poses["concept"].to_numpy() == registrations.concept).all()


def test_the_true_pose_takes_each_source_onto_its_model(tiny, made):
    _, objects = tiny
    registrations, _, _ = made
    for i in np.flatnonzero(registrations.concept != "noise"):
        T = registrations.T_target_source("true", i) @ inverse(registrations.T_target_source("icp", i))
        index = registrations.object_index[i]
        model = objects.points(index) / objects.diameters_m[index]
        distances, _ = cKDTree(model).query(transform(T, registrations.cloud(i)))
        assert np.median(distances) < 0.02


def test_every_sample_bears_the_initial_pose_and_pose_samples_more(made):
    registrations, _, poses = made
    moved = registrations.concept == "pose"
    assert (poses.loc[~moved, "init_error"] < 0.08).all()  # 5° and 3 % of the diameter
    assert (poses.loc[~moved, "init_error"] > 0).all()
    assert (registrations.severity_rotation_rad[moved] >= np.deg2rad(15)).all()
    assert not registrations.severity_rotation_rad[~moved].any()
    asymmetric = moved & ~poses["symmetric"].to_numpy()
    assert poses.loc[asymmetric, "init_error"].min() > 0.03


def test_overlap_is_lost_to_an_occluder_or_to_a_half_space(tiny, made):
    registrations, _, poses = made
    overlap = registrations.concept == "overlap"
    assert set(poses.loc[~overlap, "lost_to"]) == {""}
    assert set(poses.loc[overlap, "lost_to"]) == {OCCLUDER, HALF_SPACE}
    assert ((registrations.severity_crop[overlap] > 0.15) & (registrations.severity_crop[overlap] < 0.65)).all()
    _, _, none = make_frame_registrations(*tiny, "tiny", 0, replace(SETTINGS, occluders=0.0))
    assert set(none.loc[overlap, "lost_to"]) == {HALF_SPACE}


def test_what_an_occluder_leaves_was_measured_there(tiny, made):
    instances, _ = tiny
    registrations, _, poses = made
    row = int(np.flatnonzero(poses["lost_to"] == OCCLUDER)[0])
    i = int(poses["instance"].iloc[row])
    T_init_icp = inverse(registrations.T_target_source("icp", row))
    in_camera_m = transform(
        instances.T_camera_object_init[i],
        registrations.diameter_m[row] * transform(T_init_icp, registrations.cloud(row)),
    )
    assert cKDTree(instances.cloud_m(i)).query(in_camera_m)[0].max() < 1e-4
    assert len(registrations.cloud(row)) < min(256, len(instances.cloud_m(i)))


def test_a_sample_does_not_depend_on_how_many_there_are(tiny, made):
    registrations, _, poses = made
    few = replace(SETTINGS, registration=replace(SETTINGS.registration, train=9, test=3))
    fewer, _, fewer_poses = make_frame_registrations(*tiny, "tiny", 0, few)
    for i, (split, sample) in enumerate(zip(fewer.split, fewer.sample, strict=True)):
        same = int(np.flatnonzero((registrations.split == split) & (registrations.sample == sample))[0])
        assert np.array_equal(fewer.cloud(i), registrations.cloud(same))
        assert fewer_poses["icp_error"].iloc[i] == poses["icp_error"].iloc[same]


def test_a_symmetric_object_may_end_in_any_of_its_poses(tiny, made):
    instances, objects = tiny
    named = Instances(**{**vars(instances), "symmetric": np.ones(len(instances), bool)})
    _, _, lenient = make_frame_registrations(named, objects, "tiny", 0, SETTINGS)
    _, _, poses = made
    assert (lenient["icp_error"] <= poses["icp_error"] + 1e-12).all()
    assert (lenient["icp_error"] < 0.9 * poses["icp_error"]).any()


@pytest.mark.parametrize("share", [0.25, 0.4, 0.6])
def test_an_occluder_covers_the_share_in_one_piece(tiny, share):
    from scipy.ndimage import label

    instances, _ = tiny
    i = int(np.argsort(np.diff(instances.offsets))[len(instances) // 3])
    pixels = instances.pixels_of(i)
    kept = occlude(instances, i, pixels, share, np.random.default_rng(3))
    assert abs((1 - kept.mean()) - share) <= TOLERANCE
    covered = np.zeros((120, 160), bool)
    covered[tuple(pixels[~kept][:, ::-1].T)] = True
    regions, count = label(covered, np.ones((3, 3)))
    assert np.bincount(regions.ravel())[1:].max() > 0.9 * covered.sum()
    assert count < 5
