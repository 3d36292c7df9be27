"""Points in tables of numbers: NumPy's files, text, and KITTI's."""

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.point_files import from_entry, parse_pcd, read_table

# The layout of the UW dataset.
HEADER = """# .PCD v.7 - Point Cloud Data file format
FIELDS x y z rgb imX imY
SIZE 4 4 4 4 4 4
TYPE F F F F F F
COUNT 1 1 1 1 1 1
WIDTH {width}
HEIGHT {height}
VIEWPOINT 0 0 0 1 0 0 0
POINTS {points}
DATA {data}
"""
ROWS = ["0.1 0.2 0.7 4.5107335e-39 314 218", "-0.1 0.25 0.75 1e-39 315 218", "nan nan nan 0 0 0", "0 0.5 0.5 0 1 1"]


def ascii_pcd(rows, width=None, height=1, points=None, data="ascii"):
    width = len(rows) // height if width is None else width
    points = len(rows) if points is None else points
    return (HEADER.format(width=width, height=height, points=points, data=data) + "\n".join(rows) + "\n").encode()


def binary_pcd(points, header_points=None):
    """x, y, z between other fields, one of them repeated, one with two values, two of one name."""
    dtype = [("a", "<u1", 3), ("z", "<f8"), ("x", "<f4"), ("b", "<i2", 2), ("y", "<f4")]
    table = np.zeros(len(points), dtype)
    for i, axis in enumerate("xyz"):
        table[axis] = points[:, i]
    table["a"], table["b"] = 255, -1
    n = len(points) if header_points is None else header_points
    header = f"VERSION 0.7\nFIELDS _ z x _ y\nSIZE 1 8 4 2 4\nTYPE U F F I F\nCOUNT 3 1 1 2 1\nWIDTH {n}\nHEIGHT 1\n"
    return f"{header}POINTS {n}\nDATA binary\n".encode() + table.tobytes()


def test_points_are_read_from_ascii_and_from_binary_among_other_fields():
    points = parse_pcd(ascii_pcd([ROWS[0], ROWS[1], ROWS[3]]), "x")
    assert points.dtype == np.float64
    assert points.tolist() == [[0.1, 0.2, 0.7], [-0.1, 0.25, 0.75], [0, 0.5, 0.5]]
    points = np.random.default_rng(0).normal(size=(50, 3)).astype(np.float32)
    assert np.array_equal(parse_pcd(binary_pcd(points), "x"), points)


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_agrees_with_open3d(encoding, tmp_path):
    import open3d as o3d

    rng = np.random.default_rng(0)
    # Random, constant and periodic stretches: literals, short and long copies, copies that overlap themselves.
    points = np.vstack([rng.normal(size=(300, 3)), np.full((500, 3), 0.5), np.tile(rng.normal(size=(7, 3)), (90, 1))])
    points = points.astype(np.float32).astype(np.float64)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.colors = o3d.utility.Vector3dVector(rng.uniform(size=points.shape))
    path = str(tmp_path / "cloud.pcd")
    o3d.io.write_point_cloud(path, cloud, write_ascii=encoding == "ascii", compressed=encoding == "binary_compressed")
    content = (tmp_path / "cloud.pcd").read_bytes()
    assert f"DATA {encoding}\n".encode() in content
    assert parse_pcd(content, "x") == pytest.approx(points, abs=1e-9 if encoding != "ascii" else 1e-6)
    for kept in (len(content) - 40, len(content) - 400):
        with pytest.raises(InputError, match=r"^x: is not a readable PCD"):
            parse_pcd(content[:kept], "x")


def test_views_have_no_points_where_depth_is_missing(tmp_path):
    (tmp_path / "a_1_1_1.pcd").write_bytes(ascii_pcd(ROWS, width=2, height=2))
    [view] = from_entry({}, tmp_path)
    assert len(view.vertices_m) == 3
    (tmp_path / "a_1_1_1.pcd").write_bytes(ascii_pcd([*ROWS[:3], "inf 0 0 0 0 0"], width=2, height=2))
    with pytest.raises(InputError, match=r"a_1_1_1\.pcd: 1 of 3 points contain NaN or infinity"):
        list(from_entry({}, tmp_path))


GOOD = ascii_pcd([ROWS[0], ROWS[1]]).decode()
WRONG = {
    "empty file": ("", "DATA"),
    "no data line": (GOOD.replace("DATA ascii", "DATE ascii"), "DATA"),
    "data unknown": (GOOD.replace("DATA ascii", "DATA base64"), "DATA base64"),
    "no fields": (GOOD.replace("FIELDS", "COLUMNS"), "FIELDS"),
    "no z": (GOOD.replace("x y z", "x y w"), "lacks x, y or z"),
    "short size": (GOOD.replace("SIZE 4", "SIZE"), "differ in length"),
    "unknown type": (GOOD.replace("TYPE F", "TYPE Q"), "TYPE"),
    "double x": (GOOD.replace("COUNT 1", "COUNT 2"), "x, y or z"),
    "points differ": (GOOD.replace("POINTS 2", "POINTS 3"), "POINTS is not"),
    "points no number": (GOOD.replace("POINTS 2", "POINTS two"), "two"),
    "count with an underline": (GOOD.replace("COUNT 1 1 1 1", "COUNT 1 1 1 0_1"), "'0_1' is not a whole number"),
    "rows missing": (GOOD.replace("WIDTH 2", "WIDTH 9").replace("POINTS 2", "POINTS 9"), "9×6"),
    "value missing": (GOOD.replace(" 315 218", " 315"), "column"),
    "no number": (GOOD.replace("0.75", "abc"), "abc"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_wrong_header_or_data(fault):
    content, message = WRONG[fault]
    with pytest.raises(InputError, match=f"^view.pcd: .*{message}"):
        parse_pcd(content.encode(), "view.pcd")


@pytest.mark.parametrize("header_points", [49, 51, 10**15])
def test_binary_of_another_size(header_points):
    with pytest.raises(InputError, match="bytes of data"):
        parse_pcd(binary_pcd(np.ones((50, 3)), header_points), "x")


def test_damaged_compression():
    header = HEADER.format(width=1, height=1, points=1, data="binary_compressed").encode()
    for body in (b"", b"\x09\0\0\0", b"\x03\0\0\0\x18\0\0\0\x20\xff\xff", b"\x02\0\0\0\x18\0\0\0\x00\x41"):
        with pytest.raises(InputError, match="not a readable PCD"):
            parse_pcd(header + body, "x")


POINTS = np.random.default_rng(0).normal(size=(70, 3))
WIDE = np.column_stack([POINTS, np.arange(70)])


def text(separator, head="", rows=WIDE):
    body = "\n".join(separator.join(f"{x:.9g}" for x in row) for row in rows)
    return lambda path: path.write_text(f"{head}{body}\n")


def scanned(columns):
    """Rows of KITTI (4 columns) or nuScenes (5)."""
    return np.column_stack([WIDE, np.arange(70) % 32, WIDE])[:, :columns].astype("<f4")


FILES = {
    "cloud.npy": lambda path: np.save(path, WIDE),
    "single.npy": lambda path: np.save(path, POINTS.astype(np.float32)),
    "pixels.npy": lambda path: np.save(path, POINTS.reshape(7, 10, 3)),
    "named.npy": lambda path: np.save(path, np.rec.fromarrays(POINTS.T, names="x,y,z")),
    "cloud.npz": lambda path: np.savez(path, normals=-POINTS, points=POINTS),
    "only.npz": lambda path: np.savez_compressed(path, whatever=POINTS),
    "cloud.xyz": text(" ", "# x y z i\n"),
    "count.xyz": text(" ", "70\n"),
    "cloud.csv": text(","),
    "head.csv": text(";", "intensity;Z;y;x\n", WIDE[:, ::-1]),
    "cloud.txt": text(" "),
    "cloud.asc": text("\t", "//X Y Z I\n"),
    "cloud.pts": text(" ", "70\n"),
    "cloud.bin": lambda path: WIDE.astype("<f4").tofile(path),
    "ring.bin": lambda path: scanned(5).tofile(path),
    "cloud.pcd.bin": lambda path: scanned(5).tofile(path),
}


@pytest.mark.parametrize("name", FILES)
def test_points_are_read_from_every_format(tmp_path, name):
    FILES[name](tmp_path / name)
    points = read_table(tmp_path / name)
    assert points.dtype == np.float64
    np.testing.assert_allclose(points, POINTS, atol=1e-6)


def test_pandas_writes_nothing_for_nan(tmp_path):
    (tmp_path / "cloud.csv").write_text("x,y,z,i\n1,2,3,\n,,,\n4,,6,1\n")
    points = read_table(tmp_path / "cloud.csv")
    np.testing.assert_array_equal(points, [[1, 2, 3], [np.nan] * 3, [4, np.nan, 6]])


FAULTS = {
    "few.npy": (lambda path: np.save(path, POINTS[:, :2]), r"has the shape \(70, 2\), not \(N, 3\); export it as"),
    "turned.npy": (lambda path: np.save(path, POINTS.T), r"has the shape \(3, 70\), not \(N, 3\); transpose it"),
    "texts.npy": (lambda path: np.save(path, POINTS.astype(str)), "holds values of type <U32, not numbers"),
    "pickle.npy": (lambda path: np.save(path, np.array([{}]), allow_pickle=True), "is not a readable .npy file"),
    "cut.npy": (lambda path: path.write_bytes(b"\x93NUMPY"), "is not a readable .npy file"),
    "two.npz": (lambda path: np.savez(path, a=POINTS, b=POINTS), r"holds several arrays \(a, b\), none of them named"),
    "two.xyz": (text(" ", rows=POINTS[:, :2]), "has 2 columns; export it"),
    "words.xyz": (lambda path: path.write_text("1 2 3\n4 five 6\n"), "is no table of numbers"),
    "underline.csv": (lambda path: path.write_text("1,2,3\n4,5_0,6\n"), "is no table of numbers"),
    "empty.csv": (lambda path: path.write_text("# nothing\n"), "has no points"),
    "head.csv": (lambda path: path.write_text("x,y,z\n"), "has no points"),
    "names.csv": (lambda path: path.write_text("lat,lon,height\n1,2,3\n"), "has the columns lat, lon, height, not x"),
    "odd.bin": (lambda path: path.write_bytes(bytes(101)), "does not hold rows of 4 or 5 float32: x, y, z in meters"),
    "zeros.bin": (lambda path: path.write_bytes(bytes(160)), "does not hold rows of 4 or 5 float32"),
    "other.bin": (lambda path: np.full(64, 0x7F7F7F7F, "<u4").tofile(path), "does not hold rows of 4 or 5 float32"),
    "three.bin": (lambda path: scanned(3)[:68].tofile(path), "does not hold rows of 4 or 5 float32"),
    "above.bin": (lambda path: (10 + scanned(3))[:68].tofile(path), "does not hold rows of 4 or 5 float32"),
    "six.bin": (lambda path: scanned(6).tofile(path), "does not hold rows of 4 or 5 float32"),
    "doubles.bin": (lambda path: POINTS.tofile(path), "does not hold rows of 4 or 5 float32"),
    "kitti.pcd.bin": (lambda path: scanned(4).tofile(path), "does not hold rows of 5 float32"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_file_that_cannot_be_right_is_one_line(tmp_path, name):
    write, message = FAULTS[name]
    write(tmp_path / name)
    with pytest.raises(InputError, match=message) as caught:
        read_table(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}: ")
    assert "\n" not in str(caught.value)


def view(depth):
    return ascii_pcd([f"0 {i / 100} {depth} 0 0 0" for i in range(3)])


@pytest.fixture
def mugs(tmp_path):
    """Instance 1: sequences 1, 2 and 4 of 20 frames each, in the order of names that no number keeps."""
    (folder := tmp_path / "coffee_mug_1").mkdir()
    for sequence in (1, 2, 4):
        for frame in range(1, 21):
            (folder / f"coffee_mug_1_{sequence}_{frame}.pcd").write_bytes(view(frame))
    (folder / "readme.txt").write_text("hello")
    return tmp_path


def test_views_are_spread_evenly_over_frames_and_instances_in_several_folders_told_apart(mugs):
    found = list(from_entry({}, mugs))
    assert [surface.name for surface in found] == [
        f"coffee_mug_1_{sequence}_{frame}" for sequence in (1, 2, 4) for frame in (1, 11)
    ]
    assert found[1].vertices_m[:, 2].tolist() == [11, 11, 11]
    assert found[0].faces is None
    for name in ("apple_1_1_1", "apple_1_1_2", "apple_2_1_1", "loose"):
        (mugs / f"{name}.pcd").write_bytes(view(500))
    found = list(from_entry({"views_per_instance": 1, "unit": "mm"}, mugs))
    assert [surface.name for surface in found] == ["apple_1_1_1", "apple_2_1_1", "coffee_mug_1_1_1", "loose"]
    assert found[-1].vertices_m[:, 2] == pytest.approx(np.full(3, 0.5))
    (mugs / "loose.pcd").write_bytes(view(1).replace(b"FIELDS", b"FEILDS"))
    with pytest.raises(InputError, match=r"loose\.pcd: .*FIELDS"):
        list(from_entry({}, mugs))
