import numpy as np
import pytest

from gpca.alignment.rigid import exp
from gpca.errors import InputError
from gpca.model.clouds import read_points, read_pose

trimesh = pytest.importorskip("trimesh")
POINTS = np.random.default_rng(0).uniform(size=(200, 3)) * [0.1, 0.2, 0.3]


def written(folder, name, points=POINTS):
    path = folder / name
    if name.endswith(".pcd"):
        head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        rows = "\n".join(" ".join(f"{x:.9g}" for x in point) for point in points)
        path.write_text(f"{head}WIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA ascii\n{rows}\n")
    else:
        trimesh.PointCloud(points).export(path)
    return path


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.pcd", "CLOUD.PLY"])
def test_a_cloud_keeps_its_points_in_its_unit(tmp_path, name):
    points, frame = read_points(written(tmp_path, name.lower()).rename(tmp_path / name), "m")
    np.testing.assert_allclose(points, POINTS, atol=1e-7)
    in_mm, frame_mm = read_points(written(tmp_path, "mm.ply", 1e3 * POINTS), "mm")
    np.testing.assert_allclose(in_mm, 1e3 * POINTS, rtol=1e-6, atol=1e-4)
    assert frame_mm.diameter == pytest.approx(1e3 * frame.diameter)


@pytest.mark.parametrize("suffix", ["stl", "obj", "off", "ply"])
def test_a_mesh_is_sampled_in_its_own_frame_and_measured_by_its_vertices(tmp_path, suffix):
    box = trimesh.creation.box((30, 40, 120)).apply_translation((500, 0, 0))
    box.export(tmp_path / f"box.{suffix}")
    points, frame = read_points(tmp_path / f"box.{suffix}", "mm")
    assert len(points) > 10_000
    np.testing.assert_allclose(frame.center_3, (500, 0, 0), atol=1e-3)
    assert frame.diameter == pytest.approx(130)
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], box.bounds, atol=0.05)


@pytest.mark.parametrize(
    ("make", "unit", "message"),
    [
        (lambda f: f / "lost.ply", "m", "lost.ply: no such file; give one of .ply"),
        (lambda f: written(f, "few.ply", POINTS[:10]), "m", "few.ply: has 10 points; give 64 or more"),
        (lambda f: written(f, "few.pcd", POINTS[:10]), "m", "few.pcd: has 10 points"),
        (lambda f: written(f, "nan.ply", np.where(POINTS > 0.29, np.nan, POINTS)), "m", "nan.ply: .* contain NaN"),
        (
            lambda f: written(f, "mm.ply", 1e3 * POINTS),
            "m",
            "mm.ply: its diameter is .* in millimeters. give --unit mm",
        ),
        (lambda f: written(f, "m.ply"), "mm", "m.ply: its diameter is .* m, so the declared unit"),
        (lambda f: written(f, "cloud.ply").rename(f / "cloud.abc"), "m", "cloud.abc: has an unsupported format"),
    ],
)
def test_a_file_that_cannot_be_right_is_one_line(tmp_path, make, unit, message):
    with pytest.raises(InputError, match=message):
        read_points(make(tmp_path), unit)


@pytest.mark.parametrize("name", ["cloud.ply", "cloud.pcd", "box.stl", "box.obj", "box.ply"])
def test_a_cloud_or_mesh_that_an_offset_has_rounded_is_refused(tmp_path, name):
    if name.startswith("cloud"):
        path = written(tmp_path, name, (POINTS + 1e6).astype(np.float32))
    else:
        mesh = trimesh.creation.icosphere(2, radius=0.1)
        mesh.vertices = (mesh.vertices + 1e6).astype(np.float32).astype(float)
        mesh.export(path := tmp_path / name)
    with pytest.raises(InputError, match=rf"{name}: at coordinates of 1e\+06, float32 has steps of 0.062, .* subtract"):
        read_points(path, "m")
    read_points(written(tmp_path, "near.ply", (POINTS + 1e3).astype(np.float32)), "m")


def test_a_pose_is_16_numbers_however_they_are_parted(tmp_path):
    T = exp(np.array([[0.1, 0.2, 0.3, 1.0, 2.0, 3.0]]))[0]
    np.savetxt(tmp_path / "rows.txt", T)
    (tmp_path / "commas.txt").write_text(", ".join(map(str, T.ravel())))
    for name in ("rows.txt", "commas.txt"):
        np.testing.assert_allclose(read_pose(tmp_path / name), T)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "no such file"),
        ("1 0 0", "contains 3 numbers; give 4×4"),
        ("one " * 16, "is not a number"),
        (" ".join(map(str, (2 * np.eye(4)).ravel())), "the pose is not a rigid transform"),
        (" ".join(map(str, np.diag([-1, 1, 1, 1]).ravel())), "the pose is not a rigid transform"),
        (" ".join(["nan"] * 16), "something that is not a number: 'nan' is not a finite"),
        (" ".join(map(str, np.eye(4).astype(int).ravel())).replace("1", "١"), "'١' is not a finite decimal number"),
        (" ".join(map(str, np.eye(4).astype(int).ravel())).replace(" 0", " 0_0"), "'0_0' is not a finite decimal"),
        (" ".join(map(str, (np.eye(4) + np.eye(4, k=3) * 1e16).ravel())), "the pose has a translation of 1e\\+16"),
        (" ".join(map(str, np.diag([1, 1, 1, 5]).ravel())), "the pose is not a rigid transform"),
    ],
)
def test_what_is_no_pose(tmp_path, text, message):
    if text is not None:
        (tmp_path / "pose.txt").write_text(text)
    with pytest.raises(InputError, match=message):
        read_pose(tmp_path / "pose.txt")
