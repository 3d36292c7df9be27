"""Pairs of scans by registration methods: starts, errors, and what the methods are given."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.methods import registry
from gpca.alignment.methods.interface import FailedRegistration, MethodEntry, Outcome
from gpca.scans.pair import Rung, rungs_of
from gpca.scans.scene import ScanPairs
from gpca.steps.scans import TrialSettings, errors_of, pair_to_register, scan_normals, try_methods
from tests.scans.tiny import pair

LADDER = (Rung(0, 0), Rung(20, 0.3))
SETTINGS = TrialSettings(voxel_m=0.04, points=300, ladder=LADDER, global_start="oracle")


def no_match(_pair):
    raise FailedRegistration("no match")


STILL = MethodEntry("Still", lambda given: Outcome.at(given, given.T_target_source_init, 1.0))
BLIND = MethodEntry("Blind", no_match, is_global=True)


@pytest.fixture
def rows(monkeypatch):
    pairs = ScanPairs.of([pair(), pair("object"), pair(source="2")])
    truths = iter([pair().T_target_source, *(each.T_target_source for each in pairs)])  # the first call is not timed

    def oracle(given):
        T = next(truths).copy()
        T[:3, 3] /= 1 if len(asked) != 2 else pairs[1].scale
        asked.append(given)
        return Outcome.at(given, T, 1.0)

    asked = []
    methods = {"oracle": MethodEntry("Oracle", oracle, is_global=True), "still": STILL, "blind": BLIND}
    monkeypatch.setattr(registry.REGISTRY, "by_module", lambda: {"m": methods})
    return try_methods(pairs, "tiny", 0, {name: {} for name in methods}, SETTINGS)


def test_local_methods_start_on_the_ladder_and_at_global_poses_and_failures_have_a_reason(rows):
    still = rows["still"]
    assert still["start"].tolist() == ["initial", "oracle"] * 3
    rungs = rungs_of(3, LADDER, "tiny", 0)
    assert still["rung"].tolist() == [rung.name for rung in rungs for _ in range(2)]
    assert still["kind"].tolist() == ["room"] * 2 + ["object"] * 2 + ["room"] * 2
    first = still[still["start"] == "initial"]
    off_3 = np.array([rung.rotation_deg for rung in rungs])
    np.testing.assert_allclose(np.rad2deg(first["rotation_error_rad"]), off_3, atol=1e-5)
    assert ((first["rmse_m"] > 1e-3) == (off_3 > 0)).all()
    # At the pose of the global method they are right, whatever the unit that they were given.
    assert still[still["start"] == "oracle"]["rmse_m"].tolist() == pytest.approx([0, 0, 0], abs=1e-9)
    assert rows["oracle"]["start"].tolist() == ["none"] * 3 and (rows["oracle"]["seconds"] >= 0).all()
    assert set(rows["blind"]["failure"]) == {"no match"} and (rows["blind"]["fitness"] == 0).all()


@pytest.mark.parametrize("kind", ["room", "object"])
def test_scans_are_given_in_meters_of_a_room(kind):
    scans = pair(kind)
    given = pair_to_register(scans, LADDER[1], SETTINGS, "tiny", 0)
    assert len(given.source) <= 300 and len(given.source) == len(given.source_normals)
    assert np.ptp(given.source, axis=0).max() == pytest.approx(
        np.ptp(scans.source_N_3, axis=0).max() / scans.scale, abs=0.1
    )
    start = given.T_target_source_init.copy()
    start[:3, 3] *= scans.scale
    errors = errors_of(scans, start)
    assert errors["rotation_error_rad"] == pytest.approx(np.deg2rad(20))
    assert 0.2 * scans.scale < errors["rmse_m"] < 1.0 * scans.scale
    again = pair_to_register(scans, LADDER[1], SETTINGS, "tiny", 0)
    assert (again.source == given.source).all() and again.seed == given.seed
    assert len(pair_to_register(scans, LADDER[0], replace(SETTINGS, points=64), "tiny", 0).target) == 64


def test_normals_point_to_the_sensor():
    x, y = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 20))
    plane = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    for height in (1.0, -1.0):
        normals = scan_normals(plane, 0.2, np.array([0.5, 0.5, height]))
        np.testing.assert_allclose(normals, np.tile([0, 0, height], (400, 1)), atol=1e-9)
    two = np.concatenate([plane, plane + np.array([0, 0, 1.0])])
    outward = scan_normals(two, 0.2, None)
    assert (outward[:400, 2] < -0.99).all() and (outward[400:, 2] > 0.99).all()
