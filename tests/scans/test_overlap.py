"""Overlap, strata of it, and the pairs that are drawn from these."""

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.scans.pair import voxels
from gpca.scans.scene import Known, Scene, choose_pairs, stratum_of

from .tiny import scene

EDGES = (0.1, 0.3, 0.5, 0.7, 1.0)


def test_overlap_is_the_share_of_the_target_that_the_source_has():
    shares = {(known.target, known.source): known.overlap for known in scene().known()}
    assert shares == pytest.approx({("0", "1"): 0.5, ("0", "2"): 0.2, ("1", "2"): 0.7}, abs=0.06)
    assert {(known.target, known.source): known.overlap for known in scene("object").known()} == pytest.approx(
        shares, abs=0.06
    )
    [inside] = scene(windows=((0.0, 2.0), (0.5, 1.5))).known()
    assert inside.overlap == pytest.approx(0.5, abs=0.06)


def test_what_a_data_set_prints_comes_first():
    printed = (Known("2", "0", 0.42), Known("0", "1", None, scene().scans["1"].T_scene_scan))
    of = Scene("floor", "room", scene().scans, printed)
    first, second = of.known()
    assert (first.overlap, first.target) == (0.42, "2")
    np.testing.assert_array_equal(second.T_target_source, of.scans["1"].T_scene_scan)
    assert of.pair(first).overlap == 0.42
    with pytest.raises(InputError, match="scene floor: lists a pair with scan '7'"):
        Scene("floor", "room", scene().scans, (Known("0", "7"),))
    with pytest.raises(InputError, match="scene floor: has 1 scans; give at least two"):
        Scene("floor", "room", {"0": scene().scans["0"]})


def test_a_voxel_has_the_mean_of_its_points():
    points = np.array([[0.0, 0, 0], [0.4, 0, 0], [1.1, 0, 0], [0.1, 0.9, 0]])
    np.testing.assert_allclose(voxels(points, 1.0), [[0.5 / 3, 0.3, 0], [1.1, 0, 0]])
    assert len(voxels(points, 0.05)) == 4
    with pytest.raises(InputError, match=r"scan: spans 1.1e.13 m, too much for voxels of 0.001 m; correct its unit"):
        voxels(points * 1e13, 0.001)


def test_strata_hold_their_lower_edge_and_the_last_its_upper_one():
    names = [stratum_of(share, EDGES) for share in (0.05, 0.1, 0.29, 0.3, 0.7, 1.0)]
    assert names == [None, *["overlap_0.1_0.3"] * 2, "overlap_0.3_0.5", *["overlap_0.7_1"] * 2]


def test_pairs_are_drawn_stratum_by_stratum_whatever_other_scenes_there_are():
    chosen = choose_pairs([scene(name="a"), scene(name="b")], EDGES, 1, "tiny", 0)
    alone = choose_pairs([scene(name="b")], EDGES, 1, "tiny", 0)
    assert [pair.scene for pair in chosen[:2]] == ["a", "b"]
    assert [pair.name for pair in chosen if pair.scene == "b"] == [pair.name for pair in alone]
    strata = [stratum_of(pair.overlap, EDGES) for pair in chosen]
    assert strata == sorted(strata) and len(chosen) == 6
    wide = [pair.name for pair in choose_pairs([scene()], (0.0, 1.0), 2, "tiny", 0)]
    assert len(wide) == 2 and wide == sorted(wide)
    draws = {tuple(p.name for p in choose_pairs([scene()], (0.0, 1.0), 2, "tiny", seed)) for seed in range(8)}
    assert len(draws) > 1
