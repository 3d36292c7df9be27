"""Where scans come from, the virtual ones, and the file of a run that holds pairs of them."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.scans.pair import near
from gpca.scans.scene import ScanPairs
from gpca.scans.source import data_files, entry_of, place_of, scenes_of
from gpca.scans.virtual import compound, room

from .test_readers import write_npz
from .tiny import pair, scene

FOLDER = {"title": "Tiny", "kind": "npz", "location": "scans"}
VIRTUAL = {"title": "Virtual", "kind": "virtual", "objects": 1, "views": 2}


def test_an_optional_data_set_may_be_missing_and_another_not(tmp_path):
    assert place_of(entry_of(FOLDER | {"optional": True}), str(tmp_path)) is None
    with pytest.raises(InputError, match=r"scans: no such file or folder; get it from https://example.org"):
        place_of(entry_of(FOLDER | {"address": "https://example.org"}), str(tmp_path))
    path = write_npz(tmp_path / "scans/floor.npz")
    assert place_of(entry_of(FOLDER), str(tmp_path)) == path.parent
    assert data_files(entry_of(FOLDER), str(tmp_path)) == [path]
    assert data_files(entry_of(VIRTUAL), None) == []
    assert place_of(entry_of(VIRTUAL), None) is None  # wherever the repository is


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"kind": "bag"}, "kind: 'bag' should be"),
        ({"location": None}, "location: is missing; name the file or folder"),
        ({"scenes": "street"}, "scenes: 'street' should be"),
        ({"kind": "virtual"}, "rooms: there are neither rooms nor objects"),
        ({"place": "x"}, "place: unknown"),
    ],
)
def test_faults_of_an_entry(settings, message):
    with pytest.raises(InputError, match=message):
        entry_of(FOLDER | settings)


def test_scenes_of_development_are_apart_and_large_scans_are_thinned(tmp_path):
    for name in ("a", "b"):
        write_npz(tmp_path / f"{name}.npz")
    entry = entry_of(FOLDER | {"development": ["a"], "families": {"b": "floors"}})
    [development] = scenes_of(entry, tmp_path, "development", 10**6)
    [evaluation] = scenes_of(entry, tmp_path, "evaluation", 50)
    assert (development.name, evaluation.name, evaluation.family) == ("a", "b", "floors")
    assert {len(scan.points_N_3) for scan in evaluation.scans.values()} == {50}
    assert near(evaluation.scans["0"].points_N_3, development.scans["0"].points_N_3, 1e-6).all()
    with pytest.raises(InputError, match="has no scene for development"):
        list(scenes_of(entry_of(FOLDER), tmp_path, "development", 50))
    with pytest.raises(InputError, match="Tiny: its data is not there; set data_dir"):
        list(scenes_of(entry_of(FOLDER), None, "evaluation", 50))


def test_virtual_scans_of_one_scene_show_one_surface():
    for made, near_m in ((room("room_7", 3), 0.1), (compound("object_7", 6), 0.01)):
        [first, *_] = made.known()
        assert first.overlap > 0.2
        scans = made.pair(first)
        assert (scans.source_viewpoint_3 == 0).all()
        moved = scans.source_N_3[scans.source_common_N]
        assert len(moved) > 300 and np.isfinite(moved).all()
        with_truth = near(transformed(scans), scans.target_M_3, near_m).mean()
        assert with_truth > first.overlap - 0.15
    assert 0.1 < compound("object_7", 2).size_m < 0.5


def transformed(scans):
    from gpca.alignment.rigid import transform

    return transform(scans.T_target_source, scans.source_N_3)


def test_virtual_scenes_are_drawn_by_their_names():
    first, again, other = (compound(name, 2).scans["1"].points_N_3 for name in ("object_0", "object_0", "object_1"))
    assert (first == again).all() and first.shape != other.shape
    entry = entry_of(VIRTUAL)
    names = [next(scenes_of(entry, None, role, 100)).name for role in ("evaluation", "development")]
    assert names == ["object_0", "object_100"]


def test_pairs_are_read_as_they_were_written(tmp_path):
    pairs = [pair(), pair(target="0", source="2"), pair("object", "1", "2")]
    collected = ScanPairs.of(pairs)
    assert len(collected.scan) == 3  # each scan once
    collected.save(tmp_path / "scans.npz", ("tiny", 0))
    read = ScanPairs.load(tmp_path / "scans.npz", ("tiny", 0))
    assert len(read) == 3 and list(read.cluster) == ["floor"] * 3
    for each, expected in zip(read, pairs, strict=True):
        np.testing.assert_allclose(each.source_N_3, expected.source_N_3, atol=1e-6)
        np.testing.assert_allclose(each.target_M_3, expected.target_M_3, atol=1e-6)
        assert (each.T_target_source == expected.T_target_source).all()
        assert (each.name, each.kind, each.size_m, each.overlap) == (
            *(expected.name, expected.kind, expected.size_m, expected.overlap),
        )
        assert each.source_viewpoint_3 is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"target": np.array([0, 7])}, "its pairs and scans do not belong together"),
        ({"kind": np.array(["room", "street"])}, "unknown kind 'street'; expected one of room, object"),
    ],
)
def test_a_file_whose_parts_do_not_fit_is_refused(tmp_path, change, message):
    replace(ScanPairs.of([pair(), pair(source="2")]), **change).save(tmp_path / "scans.npz")
    with pytest.raises(InputError, match=message):
        ScanPairs.load(tmp_path / "scans.npz")


def test_a_pose_is_needed_of_every_scan():
    of = scene()
    lost = replace(of, scans={name: replace(scan, T_scene_scan=None) for name, scan in of.scans.items()})
    with pytest.raises(InputError, match="scene floor: has no pose of scan '0'"):
        list(lost.known())
