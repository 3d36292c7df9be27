"""Where scans come from, the virtual ones, and the file of a run that holds pairs of them."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.rigid import scale_translation, transform
from gpca.scans import source
from gpca.scans.pair import near
from gpca.scans.scene import ScanPairs
from gpca.scans.virtual import compound, room

from .tiny import pair, scene

FOLDER = {"title": "Tiny", "kind": "npz", "location": "scans"}
VIRTUAL = {"title": "Virtual", "kind": "virtual", "objects": 1, "views": 2}


def test_an_optional_data_set_may_be_missing_and_another_not(tmp_path):
    assert source.place_of(source.entry_of(FOLDER | {"optional": True}), str(tmp_path)) is None
    with pytest.raises(InputError, match=r"scans: no such file or folder; get it from https://example.org"):
        source.place_of(source.entry_of(FOLDER | {"address": "https://example.org"}), str(tmp_path))
    path = write_npz(tmp_path / "scans/floor.npz")
    assert source.place_of(source.entry_of(FOLDER), str(tmp_path)) == path.parent
    assert source.data_files(source.entry_of(FOLDER), str(tmp_path)) == [path]
    assert source.data_files(source.entry_of(VIRTUAL), None) == []
    assert source.place_of(source.entry_of(VIRTUAL), None) is None  # wherever the repository is


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
        source.entry_of(FOLDER | settings)


def test_scenes_of_development_are_apart_and_large_scans_are_thinned(tmp_path):
    for name in ("a", "b"):
        write_npz(tmp_path / f"{name}.npz")
    entry = source.entry_of(FOLDER | {"development": ["a"], "families": {"b": "floors"}})
    [development] = source.scenes_of(entry, tmp_path, "development", 10**6)
    [evaluation] = source.scenes_of(entry, tmp_path, "evaluation", 50)
    assert (development.name, evaluation.name, evaluation.family) == ("a", "b", "floors")
    assert {len(scan.points_N_3) for scan in evaluation.scans.values()} == {50}
    assert near(evaluation.scans["0"].points_N_3, development.scans["0"].points_N_3, 1e-6).all()
    with pytest.raises(InputError, match="has no scene for development"):
        list(source.scenes_of(source.entry_of(FOLDER), tmp_path, "development", 50))
    with pytest.raises(InputError, match="Tiny: its data is not there; set data_dir"):
        list(source.scenes_of(source.entry_of(FOLDER), None, "evaluation", 50))


def test_virtual_scans_of_one_scene_show_one_surface():
    for made, near_m in ((room("room_7", 3), 0.1), (compound("object_7", 6), 0.01)):
        [first, *_] = made.known()
        assert first.overlap > 0.2
        scans = made.pair(first)
        assert (scans.source_viewpoint_3 == 0).all()
        moved = scans.source_N_3[scans.source_common_N]
        assert len(moved) > 300 and np.isfinite(moved).all()
        with_truth = near(transform(scans.T_target_source, scans.source_N_3), scans.target_M_3, near_m).mean()
        assert with_truth > first.overlap - 0.15
    assert 0.1 < compound("object_7", 2).size_m < 0.5


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


def entry(kind, **settings):
    return source.ScanEntry(title="Tiny", kind=kind, location="there", **settings)


def write_npz(path, poses="T_scene_cloud", order="index", change=lambda arrays: arrays):
    scans = scene().scans
    names = np.array([int(name) for name in scans]) if order == "index" else np.array(list(scans))
    arrays = {f"cloud_{name}": scan.points_N_3.astype(np.float32) for name, scan in scans.items()}
    arrays |= {poses: np.stack([scan.T_scene_scan for scan in scans.values()])} | ({order: names} if order else {})
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, **change(arrays))
    return path


def write_ply(path, points):
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.PointCloud(points).export(path)


def write_folder(folder, factor=1.0):
    lines = ["# name, and the pose row by row"]
    for name, scan in scene().scans.items():
        write_ply(folder / f"{name}.ply", scan.points_N_3 * factor)
        pose = scale_translation(scan.T_scene_scan, factor).ravel()
        lines.append(f"{name} {' '.join(f'{number:.9g}' for number in pose)}")
    (folder / "poses.txt").write_text("\n".join(lines) + "\n")
    return folder


def write_benchmark(folder, log="floor-evaluation/gt.log", overlaps="0,1,0.25\n"):
    of = scene()
    for name, scan in of.scans.items():
        write_ply(folder / f"floor/cloud_bin_{name}.ply", scan.points_N_3)
    text = ""
    for known in of.known():
        text += f"{known.target}\t {known.source}\t 3\n"
        text += "".join("\t ".join(f"{number:.8e}" for number in row) + "\n" for row in known.T_target_source)
    (folder / log).parent.mkdir(exist_ok=True)
    (folder / log).write_text(text)
    if overlaps:
        (folder / log).with_name("gt_overlap.log").write_text(overlaps)
    return folder


def assert_same(read, tolerance=1e-6):
    known, expected = list(read.known()), list(scene().known())
    assert [(k.target, k.source) for k in known] == [(k.target, k.source) for k in expected]
    for read_pair, true in zip(known, expected, strict=True):
        np.testing.assert_allclose(read_pair.T_target_source, true.T_target_source, atol=tolerance)
    for name, scan in scene().scans.items():
        np.testing.assert_allclose(read.scans[name].points_N_3, scan.points_N_3, atol=1e-6)


@pytest.mark.parametrize("order", ["index", "name", ""])
def test_npz(tmp_path, order):
    write_npz(tmp_path / "floor.npz", order=order)
    [read] = source.npz_scenes(entry("npz"), tmp_path)
    assert (read.name, read.kind) == ("floor", "room")
    assert_same(read)
    [alone] = source.npz_scenes(entry("npz", scenes="object"), tmp_path / "floor.npz")
    assert alone.kind == "object" and alone.scans["0"].viewpoint_3 is None
    [model] = source.npz_scenes(entry("npz", sensor_at_origin=True), write_npz(tmp_path / "b/cup.npz", "T_model_cloud"))
    assert model.kind == "object" and (model.scans["2"].viewpoint_3 == 0).all()


def test_pairs_beside_npz_files_are_those_that_count(tmp_path):
    write_npz(tmp_path / "floor.npz")
    write_npz(tmp_path / "other.npz")
    rows = "list,scene,target,source,overlap\n3DMatch,floor,0,2,0.31\n3DLoMatch,floor,0,2,0.31\n3DMatch,floor,0,1,0.6\n"
    (tmp_path / "pairs.csv").write_text(rows)
    floor, other = source.npz_scenes(entry("npz"), tmp_path)
    assert [(pair.target, pair.source, pair.overlap) for pair in floor.known()] == [("0", "2", 0.31), ("0", "1", 0.6)]
    assert len(list(other.known())) == 3


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("floor,0,2,31", "column 'overlap' contains numbers above 1; give shares"),
        ("floor,0,2,0.3", "scan 0 of floor: gives it two overlaps with 2"),
        ("floor,1,1,0.3", "scan 1 of floor: pairs it with itself"),
        ("flor,0,2,0.3", "names the scene 'flor', of which there is no npz file"),
        ("floor,0,9,0.3", "lists a pair with scan '9'"),
    ],
)
def test_pairs_that_contradict_the_scans_or_each_other_are_refused(tmp_path, row, message):
    write_npz(tmp_path / "floor.npz")
    (tmp_path / "pairs.csv").write_text(f"scene,target,source,overlap\nfloor,0,2,0.31\n{row}\n")
    with pytest.raises(InputError, match=message):
        list(source.npz_scenes(entry("npz"), tmp_path))


def without(name):
    return lambda arrays: {key: value for key, value in arrays.items() if key != name}


def changed(name, change):
    return lambda arrays: arrays | {name: change(arrays[name])}


NPZ_FAULTS = [
    (without("T_scene_cloud"), "has neither T_scene_cloud nor T_model_cloud; make it as docs/real_world.md says"),
    (without("cloud_1"), "array 'cloud_1' is missing"),
    (lambda arrays: arrays | {"cloud_9": arrays["cloud_1"]}, "array 'cloud_9' has no pose"),
    (changed("index", lambda index: index * 0), "array 'index' names a cloud twice"),
    (changed("index", lambda index: index[1:]), r"array 'index' is 2, not 3|is 3×4×4, not 2×4×4"),
    (changed("cloud_0", lambda points: points[:, :2]), "array 'cloud_0' is 1000×2, not "),
    (changed("cloud_0", lambda points: points * np.nan), "array 'cloud_0' contains NaN.*; make it as docs/real"),
    (changed("T_scene_cloud", lambda poses: 2 * poses), "T_scene_cloud of 0: the pose is not a rigid transform"),
    (changed("cloud_0", lambda points: points.astype(object)), "contains pickled objects, which are never loaded"),
]


def test_ply_folder(tmp_path):
    [read] = source.ply_scenes(entry("ply_folder", scenes="room"), write_folder(tmp_path / "floor"))
    assert (read.name, read.kind) == ("floor", "room")
    assert_same(read)
    write_folder(tmp_path / "more/a", 1000.0)
    write_folder(tmp_path / "more/b", 1000.0)
    several = list(source.ply_scenes(entry("ply_folder", scenes="object", unit="mm"), tmp_path / "more"))
    assert [each.name for each in several] == ["a", "b"]
    assert_same(several[1])


PLY_FAULTS = [
    (lambda text: "", "poses.txt: is empty"),
    (lambda text: "# none\n", "poses.txt: has no poses"),
    (lambda text: text + "0 1 2\n", "poses.txt, line 5: has 3 words; write a name and the 16 numbers"),
    (lambda text: text.replace("\n1 ", "\n0 "), "poses.txt, line 3: '0' is no name of a file beside it, or stands"),
    (lambda text: text.replace("\n1 ", "\n../1 "), r"poses.txt, line 3: '../1' is no name of a file beside it"),
    (lambda text: text.replace("0.3", "o.3", 1), "poses.txt, line 3: 'o.3' is not a finite decimal number"),
    (lambda text: text.replace("\n0 1 ", "\n0 2 "), "poses.txt, line 2: the pose is not a rigid transform"),
    (lambda text: text.replace("\n2 ", "\n3 "), "3.ply: no such file"),
]


@pytest.mark.parametrize("log", ["floor/gt.log", "floor-evaluation/gt.log"])
def test_layout_of_3dmatch(tmp_path, log):
    [read] = source.benchmark_scenes(entry("threedmatch"), write_benchmark(tmp_path, log))
    assert (read.name, read.kind) == ("floor", "room")
    assert_same(read)
    shares = [pair.overlap for pair in read.known()]
    assert shares[0] == 0.25 and shares[1:] == pytest.approx([0.2, 0.7], abs=0.06)  # those not printed are measured


BENCHMARK_FAULTS = [
    (lambda text: text[: text.rindex("\n", 0, -1)], "gt.log: has 14 lines, not 5 for each pair"),
    (lambda text: text.replace("3\n", "\n", 1), "gt.log, pair 1: it has not 3 numbers and then 4"),
    (lambda text: text.replace("1\t 3", "0\t 3", 1), "gt.log, pair 1: pairs 0 with 0 once more, or with itself"),
    (lambda text: text.replace("1.0", "9.0"), "gt.log, pair 1: the pose is not a rigid transform"),
    (lambda text: text.replace("2\t 3", "8\t 3", 1), "cloud_bin_8.ply: no such file"),
]


def test_a_benchmark_without_fragments_or_pairs_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"has no <scene>/cloud_bin_<number>.ply; correct location"):
        list(source.benchmark_scenes(entry("threedmatch"), tmp_path))
    (write_benchmark(tmp_path) / "floor-evaluation/gt.log").unlink()
    with pytest.raises(InputError, match=r"floor/gt.log: no such file; put it there, or into floor-evaluation"):
        list(source.benchmark_scenes(entry("threedmatch"), tmp_path))


OVERLAP_FAULTS = [
    (lambda text: "0,1\n", "gt_overlap.log, line 1: has 2 numbers instead of target, source and overlap"),
    (lambda text: "0,1,1.5\n", "gt_overlap.log, line 1: the overlap 1.5 is no share"),
    (lambda text: "0,x,0.5\n", "gt_overlap.log, line 1: 'x' is not a whole number"),
]
TEXTS = {
    "poses.txt": (write_folder, source.ply_scenes, entry("ply_folder", scenes="room"), PLY_FAULTS),
    "floor-evaluation/gt.log": (write_benchmark, source.benchmark_scenes, entry("threedmatch"), BENCHMARK_FAULTS),
    "floor-evaluation/gt_overlap.log": (write_benchmark, source.benchmark_scenes, entry("threedmatch"), OVERLAP_FAULTS),
}


@pytest.mark.parametrize(("name", "change", "message"), [(name, *of) for name in TEXTS for of in TEXTS[name][-1]])
def test_faults_of_text_beside_clouds(tmp_path, name, change, message):
    write, scenes, settings, _ = TEXTS[name]
    path = write(tmp_path) / name
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError, match=message):
        list(scenes(settings, tmp_path))


@pytest.mark.parametrize(("change", "message"), NPZ_FAULTS)
def test_faults_of_npz(tmp_path, change, message):
    write_npz(tmp_path / "floor.npz", change=change)
    with pytest.raises(InputError, match=message):
        list(source.npz_scenes(entry("npz"), tmp_path))


def test_folders_without_what_makes_a_scene(tmp_path):
    for scenes, settings, message in (
        (source.npz_scenes, entry("npz"), "the folder has no npz file; correct location"),
        (source.ply_scenes, entry("ply_folder"), "Tiny: does not say what its scenes are; set scenes"),
        (
            source.ply_scenes,
            entry("ply_folder", scenes="room"),
            r"poses.txt: no such file; give the poses of the scans",
        ),
    ):
        with pytest.raises(InputError, match=message):
            list(scenes(settings, tmp_path))
    (tmp_path / "floor.npz").write_text("not a zip")
    with pytest.raises(InputError, match=r"floor.npz: is not a readable npz archive; fetch it again"):
        list(source.npz_scenes(entry("npz"), tmp_path))
