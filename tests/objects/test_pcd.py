import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.point_files import parse_pcd

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


def test_ascii():
    points = parse_pcd(ascii_pcd([ROWS[0], ROWS[1], ROWS[3]]), "x")
    assert points.dtype == np.float64
    assert points.tolist() == [[0.1, 0.2, 0.7], [-0.1, 0.25, 0.75], [0, 0.5, 0.5]]


def test_binary_among_other_fields():
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


def test_organised_cloud_drops_missing_depth():
    assert len(parse_pcd(ascii_pcd(ROWS, width=2, height=2), "x")) == 3


def test_nan_in_an_unorganised_cloud():
    with pytest.raises(InputError, match=r"view\.pcd: 1 of 4 points contain NaN"):
        parse_pcd(ascii_pcd(ROWS), "view.pcd")


def test_infinity_in_an_organised_cloud():
    with pytest.raises(InputError, match="infinity"):
        parse_pcd(ascii_pcd([*ROWS[:3], "inf 0 0 0 0 0"], width=2, height=2), "x")


GOOD = ascii_pcd([ROWS[0], ROWS[1]]).decode()
WRONG = {
    "empty file": ("", "DATA"),
    "not a pcd": ("ply\nformat ascii 1.0\n", "DATA"),
    "no data line": (GOOD.replace("DATA ascii", "DATE ascii"), "DATA"),
    "data unknown": (GOOD.replace("DATA ascii", "DATA base64"), "DATA base64"),
    "no fields": (GOOD.replace("FIELDS", "COLUMNS"), "FIELDS"),
    "no width": (GOOD.replace("WIDTH 2\n", ""), "WIDTH"),
    "no z": (GOOD.replace("x y z", "x y w"), "lacks x, y or z"),
    "short size": (GOOD.replace("SIZE 4", "SIZE"), "differ in length"),
    "unknown type": (GOOD.replace("TYPE F", "TYPE Q"), "TYPE"),
    "unknown size": (GOOD.replace("SIZE 4", "SIZE 3"), "SIZE"),
    "double x": (GOOD.replace("COUNT 1", "COUNT 2"), "x, y or z"),
    "points differ": (GOOD.replace("POINTS 2", "POINTS 3"), "POINTS is not"),
    "points no number": (GOOD.replace("POINTS 2", "POINTS two"), "two"),
    "width with an underline": (GOOD.replace("WIDTH 2", "WIDTH 0_2"), "'0_2' is not a whole number"),
    "count with an underline": (GOOD.replace("COUNT 1 1 1 1", "COUNT 1 1 1 0_1"), "'0_1' is not a whole number"),
    "negative": (GOOD.replace("WIDTH 2", "WIDTH -2").replace("HEIGHT 1", "HEIGHT -1"), "'-2' is not a whole number"),
    "rows missing": (GOOD.replace("WIDTH 2", "WIDTH 9").replace("POINTS 2", "POINTS 9"), "9×6"),
    "value missing": (GOOD.replace(" 315 218", " 315"), "column"),
    "no number": (GOOD.replace("0.75", "abc"), "abc"),
    "no rows": (ascii_pcd([], points=0).decode(), "has no points"),
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
