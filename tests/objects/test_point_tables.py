"""Points in tables of numbers: NumPy's files, text, and KITTI's."""

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.point_files import read_table

POINTS = np.random.default_rng(0).normal(size=(70, 3))
WIDE = np.column_stack([POINTS, np.arange(70)])


def text(separator, head="", rows=WIDE):
    body = "\n".join(separator.join(f"{x:.9g}" for x in row) for row in rows)
    return lambda path: path.write_text(f"{head}{body}\n")


FILES = {
    "cloud.npy": lambda path: np.save(path, WIDE),
    "single.npy": lambda path: np.save(path, POINTS.astype(np.float32)),
    "pixels.npy": lambda path: np.save(path, np.insert(POINTS, 5, np.nan, axis=0)[:, None]),
    "named.npy": lambda path: np.save(path, np.rec.fromarrays(POINTS.T, names="x,y,z")),
    "cloud.npz": lambda path: np.savez(path, normals=-POINTS, points=POINTS),
    "only.npz": lambda path: np.savez_compressed(path, whatever=POINTS),
    "cloud.xyz": text(" ", "# x y z i\n"),
    "count.xyz": text(" ", "70\n"),
    "cloud.csv": text(","),
    "head.csv": text(";", "intensity;Z;y;x\n", WIDE[:, ::-1]),
    "cloud.bin": lambda path: WIDE.astype("<f4").tofile(path),
}


@pytest.mark.parametrize("name", FILES)
def test_points_are_read_from_every_format(tmp_path, name):
    FILES[name](tmp_path / name)
    points = read_table(tmp_path / name)
    assert points.dtype == np.float64
    np.testing.assert_allclose(points, POINTS, atol=1e-6)


FAULTS = {
    "few.npy": (
        lambda path: np.save(path, POINTS[:, :2]),
        r"has the shape \(70, 2\), not \(N, 3\); export it as three",
    ),
    "turned.npy": (lambda path: np.save(path, POINTS.T), r"has the shape \(3, 70\), not \(N, 3\); transpose it"),
    "texts.npy": (lambda path: np.save(path, POINTS.astype(str)), "holds values of type <U32, not numbers"),
    "pickle.npy": (lambda path: np.save(path, np.array([{}]), allow_pickle=True), "is not a readable .npy file"),
    "cut.npy": (lambda path: path.write_bytes(b"\x93NUMPY"), "is not a readable .npy file"),
    "two.npz": (lambda path: np.savez(path, a=POINTS, b=POINTS), r"holds several arrays \(a, b\), none of them named"),
    "cut.npz": (lambda path: path.write_bytes(b"PK"), "is not a readable .npz file"),
    "two.xyz": (text(" ", rows=POINTS[:, :2]), "has 2 columns; export it"),
    "ragged.xyz": (lambda path: path.write_text("1 2 3\n4 5\n"), "is no table of numbers"),
    "words.xyz": (lambda path: path.write_text("1 2 3\n4 five 6\n"), "is no table of numbers"),
    "underline.csv": (lambda path: path.write_text("1,2,3\n4,5_0,6\n"), "is no table of numbers"),
    "empty.csv": (lambda path: path.write_text("# nothing\n"), "has no points"),
    "head.csv": (lambda path: path.write_text("x,y,z\n"), "has no points"),
    "names.csv": (lambda path: path.write_text("lat,lon,height\n1,2,3\n"), "has the columns lat, lon, height, not x"),
    "odd.bin": (lambda path: path.write_bytes(bytes(100)), "has 100 bytes, which are no rows of 4 float32"),
    "other.bin": (lambda path: np.full(64, 0x7F7F7F7F, "<u4").tofile(path), "in meters, as scans of KITTI do"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_file_that_cannot_be_right_is_one_line(tmp_path, name):
    write, message = FAULTS[name]
    write(tmp_path / name)
    with pytest.raises(InputError, match=message) as caught:
        read_table(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}: ")
    assert "\n" not in str(caught.value)
