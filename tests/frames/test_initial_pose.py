from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.pose_error import pose_error
from gpca.alignment.rigid import inverse, rotation_angle_rad
from gpca.errors import InputError
from gpca.frames.initial_pose import GlobalRegistration, InitialPoseSettings, displace


def test_an_error_is_within_its_declared_size():
    T = np.eye(4)
    T[:3, 3] = (0.1, 0.2, 0.9)
    settings = InitialPoseSettings("true_pose", rotation_deg=5.0, translation=0.03)
    errors = [inverse(T) @ displace(T, 0.2, settings, np.random.default_rng(seed)) for seed in range(100)]
    angles_deg = np.rad2deg([rotation_angle_rad(error) for error in errors])
    shifts_m = np.linalg.norm([error[:3, 3] for error in errors], axis=1)
    assert 4.5 < angles_deg.max() <= 5.0
    assert 0.005 < shifts_m.max() <= 0.03 * 0.2
    assert angles_deg.min() < 0.5


def test_features_find_an_object_that_has_no_symmetry(tiny):
    instances, objects = tiny
    index = objects.names.index("tiny bracket")
    diameter_m = objects.diameters_m[index]
    settings = InitialPoseSettings(tries=10)
    registration = GlobalRegistration(objects.points(index), objects.normals(index), diameter_m, settings)
    rows = np.flatnonzero(instances.object_index == index)
    rows = rows[np.argsort(-np.diff(instances.offsets)[rows])][:2]  # the best seen
    found = [registration.register(instances.cloud_m(i), seed=1) for i in rows]
    errors = [
        pose_error(objects.points(index), T, instances.T_camera_object_true[i], False) / diameter_m
        for T, i in zip(found, rows, strict=True)
    ]
    assert min(errors) < 0.1
    assert np.array_equal(found[0], registration.register(instances.cloud_m(rows[0]), seed=1))


def test_an_unknown_form_is_refused():
    with pytest.raises(InputError, match="initial pose 'guess': unknown; choose one of results, true_pose"):
        replace(InitialPoseSettings(), form="guess")
