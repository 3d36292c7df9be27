"""Pairs of scans, what is common to both, and the error over that."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.rigid import inverse, rigid_motion, rotation_angle_rad, transform
from gpca.scans.pair import OVERLAP_M, Rung, ScanSuccess, disturbed, overlap_rmse, rungs_of, voxels
from gpca.scans.scene import Known, ScannedScene, choose_pairs, stratum_of

from .tiny import floor, pair, scene


def test_common_points_are_those_that_the_other_scan_has_too():
    scans = pair()
    x_N = transform(scans.T_target_source, scans.source_N_3)[:, 0]  # the target's frame is the scene's, but for z
    assert scans.source_common_N[x_N < 0.98].all() and not scans.source_common_N[x_N > 1 + OVERLAP_M].any()
    x_M = scans.target_M_3[:, 0]
    assert scans.target_common_M[x_M > 0.5].all() and not scans.target_common_M[x_M < 0.5 - OVERLAP_M].any()


def test_lengths_and_limits_of_an_object_are_in_proportion_and_those_of_a_room_absolute():
    scans = pair("object")
    extent = np.ptp(floor(0.0, 1.8), axis=0)
    assert scans.size_m == pytest.approx(np.linalg.norm(extent), rel=1e-6)
    assert scans.scale == pytest.approx(scans.size_m / 3)
    assert scans.overlap_m == pytest.approx(OVERLAP_M * scans.size_m / 3)
    assert (pair().scale, pair().overlap_m) == (1, OVERLAP_M)
    assert scans.cluster == "floor" and replace(scans, family="floors").cluster == "floors"
    limits = ScanSuccess(room_m=0.2, object_share=0.02)
    assert limits.limit_m(pair()) == 0.2
    assert limits.limit_m(pair("object")) == pytest.approx(0.02 * pair("object").size_m)


def test_the_error_is_that_of_the_common_points_alone():
    scans = pair()
    assert overlap_rmse(scans, scans.T_target_source) == 0
    moved = rigid_motion(np.eye(3), (0.03, 0.04, 0.0)) @ scans.T_target_source
    assert overlap_rmse(scans, moved) == pytest.approx(0.05)
    # A turn about the middle of the common points moves these by their distances from its axis.
    angle, common_n_3 = 0.1, transform(scans.T_target_source, scans.source_N_3[scans.source_common_N])
    middle_3 = common_n_3.mean(axis=0)
    R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turned = rigid_motion(R, middle_3 - R @ middle_3) @ scans.T_target_source
    radii_n = np.linalg.norm((common_n_3 - middle_3)[:, :2], axis=1)
    assert overlap_rmse(scans, turned) == pytest.approx(2 * np.sin(angle / 2) * np.sqrt(np.square(radii_n).mean()))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"source_N_3": np.zeros((2, 3))}, r"scan '1' of floor: has shape \(2, 3\)"),
        ({"target_M_3": np.full((9, 3), np.nan)}, "scan '0' of floor: has shape .* or contains NaN"),
        ({"T_target_source": 2 * np.eye(4)}, "pose of 1 in 0, floor: the pose is not a rigid transform"),
        ({"size_m": 0.0}, "scene floor: has no extent"),
    ],
)
def test_what_is_no_pair_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        replace(pair(), **changes)


EDGES = (0.1, 0.3, 0.5, 0.7, 1.0)


def test_overlap_is_the_share_of_the_target_unless_the_data_set_prints_one():
    shares = {(known.target, known.source): known.overlap for known in scene().known()}
    assert shares == pytest.approx({("0", "1"): 0.5, ("0", "2"): 0.2, ("1", "2"): 0.7}, abs=0.06)
    assert {(known.target, known.source): known.overlap for known in scene("object").known()} == pytest.approx(
        shares, abs=0.06
    )
    [inside] = scene(windows=((0.0, 2.0), (0.5, 1.5))).known()
    assert inside.overlap == pytest.approx(0.5, abs=0.06)
    printed = (Known("2", "0", 0.42), Known("0", "1", None, scene().scans["1"].T_scene_scan))
    of = ScannedScene("floor", "room", scene().scans, printed)
    first, second = of.known()
    assert (first.overlap, first.target) == (0.42, "2")
    np.testing.assert_array_equal(second.T_target_source, of.scans["1"].T_scene_scan)
    assert of.pair(first).overlap == 0.42
    with pytest.raises(InputError, match="scene floor: lists a pair with scan '7'"):
        ScannedScene("floor", "room", scene().scans, (Known("0", "7"),))
    with pytest.raises(InputError, match="scene floor: has 1 scans; give at least two"):
        ScannedScene("floor", "room", {"0": scene().scans["0"]})


def test_a_voxel_has_the_mean_of_its_points():
    points = np.array([[0.0, 0, 0], [0.4, 0, 0], [1.1, 0, 0], [0.1, 0.9, 0]])
    np.testing.assert_allclose(voxels(points, 1.0), [[0.5 / 3, 0.3, 0], [1.1, 0, 0]])
    assert len(voxels(points, 0.05)) == 4
    with pytest.raises(InputError, match=r"scan: spans 1.1e.13 m, too much for voxels of 0.001 m; correct its unit"):
        voxels(points * 1e13, 0.001)


def test_pairs_are_drawn_stratum_by_stratum_whatever_other_scenes_there_are():
    chosen = choose_pairs([scene(name="a"), scene(name="b")], EDGES, 1, "tiny", 0)
    alone = choose_pairs([scene(name="b")], EDGES, 1, "tiny", 0)
    assert [pair.scene for pair in chosen[:2]] == ["a", "b"]
    assert [pair.name for pair in chosen if pair.scene == "b"] == [pair.name for pair in alone]
    strata = [stratum_of(pair.overlap, EDGES) for pair in chosen]
    assert strata == sorted(strata) and len(chosen) == 6
    wide = [pair.name for pair in choose_pairs([scene()], (0.0, 1.0), 2, "tiny", 0)]
    assert len(wide) == 2 and wide == sorted(wide)
    pairs = len(choose_pairs([scene()], (0.0, 1.0), 99, "tiny", 0))  # of which the two stand for all
    assert sum(p.stands_for for p in choose_pairs([scene()], (0.0, 1.0), 2, "tiny", 0)) == pytest.approx(pairs)
    draws = {tuple(p.name for p in choose_pairs([scene()], (0.0, 1.0), 2, "tiny", seed)) for seed in range(8)}
    assert len(draws) > 1


@pytest.mark.parametrize("kind", ["room", "object"])
def test_a_start_is_off_by_its_rung(kind):
    scans, rung = pair(kind), Rung(40, 0.5)
    T = disturbed(scans, rung, "tiny", 0)
    assert rotation_angle_rad(T @ inverse(scans.T_target_source)) == pytest.approx(np.deg2rad(40))
    middle_3 = scans.source_N_3.mean(axis=0)
    shift_3 = transform(T, middle_3) - transform(scans.T_target_source, middle_3)
    assert np.linalg.norm(shift_3) == pytest.approx(0.5 * scans.scale)


def test_pairs_in_a_row_are_on_different_rungs_whose_order_is_drawn():
    ladder = [Rung(10 * i, 0) for i in range(5)]
    rungs = rungs_of(23, ladder, "tiny", 0)
    blocks = [tuple(rung.rotation_deg for rung in rungs[i : i + 5]) for i in range(0, 20, 5)]
    assert all(sorted(block) == [0, 10, 20, 30, 40] for block in blocks) and len(set(blocks)) > 1
    assert rungs_of(8, ladder, "tiny", 0) == rungs[:8] != rungs_of(8, ladder, "tiny", 1)
