"""Pairs of scans whose answer is known: a corner of a room seen twice, started off, cropped, or with noise added."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import gpca.causes.scans as module
from gpca.causes.candidate import Registrar
from gpca.causes.settings import OBSERVED, CauseSettings
from gpca.causes.truth import ALL, FAILED, GEOMETRY, NONE
from gpca.errors import InputError
from gpca.rigid import rigid_motion, transform
from gpca.scans.pair import ScanSuccess, overlap_rmse
from tests.scans.corner import corner_pair, start_off

SETTINGS = CauseSettings(moved=OBSERVED, clean_pairs=20)
SUCCESS = ScanSuccess()
POINTS = 192


def measured(pair, *starts):
    return module.measure_scans([pair], starts, "corner", 100, SETTINGS, SUCCESS, POINTS)


@pytest.mark.parametrize(
    ("shared", "start", "times", "cause"),
    [(1.0, (70, 0.9), 0.0, "pose"), (0.3, (0, 0.0), 0.0, "overlap"), (1.0, (0, 0.0), 60.0, "noise")],
)
def test_what_was_done_to_a_pair_is_its_cause(shared, start, times, cause):
    pair = corner_pair(shared)
    causes, table = measured(pair, module.ScanStart(0, module.LADDER, "rung", start_off(pair, *start), times))
    assert table["dominant"].tolist() == [cause]
    phi = dict(zip(("noise", "pose", "overlap"), causes.truth.phi[0], strict=True))
    assert phi[cause] > SETTINGS.limits.cause
    assert all(abs(value) < 0.5 * phi[cause] for name, value in phi.items() if name != cause)
    assert causes.truth.phi.sum() == pytest.approx(causes.truth.error[0, ALL] - causes.truth.error[0, NONE])


def test_no_natural_registration_fails_by_noise():
    pair = corner_pair(0.5)
    causes, table = measured(pair, module.ScanStart(0, module.GLOBAL, "method", start_off(pair, 20, 0.3)))
    assert causes.truth.phi[0, 0] == 0 and not causes.applied[0, 0]
    assert table["noise"].tolist() == [0] and table["sensor_noise"][0] > 0
    assert table["crop"][0] == pytest.approx(1 - pair.overlap)
    assert table["rotation_rad"][0] == pytest.approx(np.deg2rad(20))
    assert table["translation"][0] == pytest.approx(0.3 / pair.unit_m, abs=0.03)  # of the points that are drawn


def test_a_crop_of_one_scan_alone_names_a_cause_where_a_global_method_started():
    pair = corner_pair(0.3)
    kinds = (module.GLOBAL, module.LADDER)
    starts = [module.ScanStart(0, kind, kind, start_off(pair, 0, 0.0)) for kind in kinds]
    _, table = measured(pair, *starts)
    assert table["dominant_one_sided"].tolist() == ["overlap", ""]


def test_nothing_is_wrong_with_what_both_see_started_at_the_truth():
    pair = corner_pair(1.0)
    start = module.ScanStart(0, module.LADDER, "rung", pair.T_target_source)
    causes, _ = measured(pair, start)
    assert causes.truth.error[0, ALL] < SETTINGS.limits.nominal
    again, _ = measured(pair, start)
    assert np.array_equal(again.truth.error, causes.truth.error)
    assert np.array_equal(again.registrations.points, causes.registrations.points)


def test_an_error_is_the_rmse_over_the_true_overlap_in_units_of_the_limit():
    pair = corner_pair(0.5)
    scans = module.DrawnScans.of(pair, POINTS, SUCCESS.room_m, SETTINGS.limits.failed, np.random.default_rng(100))
    T_start = start_off(pair, 5, 0.1)
    T_observed_model = np.linalg.inv(module.motion_between(scans.pair, scans.pair.T_target_source, T_start))[None]
    expected = SETTINGS.limits.failed * overlap_rmse(pair, T_start) / SUCCESS.room_m
    assert scans.errors(T_observed_model)[0] == pytest.approx(expected, rel=0.1)  # of some of the points
    shifted = np.eye(4)[None].copy()
    shifted[0, 0, 3] = 0.2
    assert module.OverlapErrors(np.zeros((1, 3)), 0.5)(shifted) == pytest.approx([0.1])


def test_the_target_that_icp_is_given_is_cropped_and_noisy_only_where_the_causes_say_so():
    pair = corner_pair(0.3)
    scans = module.DrawnScans.of(pair, POINTS, 0.2, 0.03, np.random.default_rng(100))
    candidate = scans.candidate(pair.T_target_source, 2.0, np.random.default_rng(100))
    noise, pose, overlap = range(3)
    assert candidate.reference((pose, overlap)) is candidate.model
    assert candidate.reference((noise, pose, overlap)) is candidate.noisy_model
    assert len(candidate.reference(())) == len(scans.target_common) < len(candidate.model)
    assert np.array_equal(candidate.reference((noise,)), candidate.noisy_model[scans.target_common])
    assert candidate.changing_reference((noise, pose, overlap)) == (noise, overlap)
    registrar = Registrar(candidate, SETTINGS, misses=True)  # which keeps a target for each of these
    xi = np.zeros((1, 6))
    assert registrar.run((overlap,), xi).fitness_n[0] < registrar.run((), xi).fitness_n[0]


def test_the_sensor_noise_is_that_across_the_surface_of_one_scan():
    assert module.sensor_noise_m(corner_pair(1.0, noise_m=0.01)) == pytest.approx(0.01, rel=0.25)
    assert module.sensor_noise_m(corner_pair(1.0, noise_m=0.002)) < 0.006  # rough planes count too


def test_lengths_of_an_object_are_relative_to_its_size():
    room = corner_pair(0.5)
    small = replace(
        room,
        source_N_3=room.source_N_3 / 10,
        target_M_3=room.target_M_3 / 10,
        T_target_source=rigid_motion(room.T_target_source[:3, :3], room.T_target_source[:3, 3] / 10),
        kind="object",
        size_m=0.3,
    )
    of = [module.DrawnScans.of(pair, POINTS, 1.0, 1.0, np.random.default_rng(100)) for pair in (room, small)]
    assert of[1].source == pytest.approx(of[0].source)
    assert np.array_equal(of[1].source_common, of[0].source_common)


def test_pairs_that_share_too_little_are_left_out_and_named(capsys):
    pair = corner_pair(0.5)
    apart = pair.T_target_source.copy()
    apart[:3, 3] += 20
    with pytest.raises(InputError, match="no registration of the scans can be measured"):
        measured(replace(pair, T_target_source=apart), module.ScanStart(0, module.LADDER, "rung", pair.T_target_source))
    assert "pair corner/target/source is skipped: too few of its points lie on surface" in capsys.readouterr().err


def test_what_finds_no_correspondence_failed_by_its_pose_and_a_ball_holds_none():
    pair = corner_pair(1.0)
    away = rigid_motion(np.eye(3), [30.0, 0, 0]) @ pair.T_target_source
    _, table = measured(pair, module.ScanStart(0, module.LADDER, "far", away))
    assert table[["missed", "state", "dominant"]].to_numpy().tolist() == [[True, FAILED, "pose"]]
    pair = corner_pair(1.0, ball=True)
    _, table = measured(pair, module.ScanStart(0, module.LADDER, "rung", start_off(pair, 1, 0.01)))
    assert table["error_clean"][0] > SETTINGS.limits.nominal and table["dominant"].tolist() == [GEOMETRY]


def test_the_registrations_know_where_the_source_truly_lies():
    pair = corner_pair(1.0)
    causes, _ = measured(pair, module.ScanStart(0, module.LADDER, "rung", start_off(pair, 40, 0.5)))
    registrations, unit_m = causes.registrations, pair.unit_m
    middle = (pair.target_M_3.min(axis=0) + pair.target_M_3.max(axis=0)) / 2
    placed = transform(registrations.T_target_source("true", 0), registrations.source(0)) * unit_m + middle
    assert cKDTree(transform(pair.T_target_source, pair.source_N_3)).query(placed)[0].max() < 1e-4
    assert cKDTree(pair.target_M_3).query(registrations.target(0) * unit_m + middle)[0].max() < 1e-4
    assert registrations.cluster.tolist() == [pair.cluster] and registrations.object_name.tolist() == [pair.name]
