"""Files of points and of poses that ``explain`` cannot take."""

import numpy as np
import pytest
import trimesh

from ..hostile import refusal

EXPLAIN = ["explain", "ball.ply", "ball.ply", "--unit", "mm", "--model", "model.pt"]
BALL = trimesh.creation.icosphere(3, radius=50)


@pytest.fixture
def folder(model, tmp_path):
    model.save(tmp_path / "model.pt")
    BALL.export(tmp_path / "ball.ply")
    return tmp_path


POINTS = np.random.default_rng(0).normal(size=(200, 3)) * 30


def cloud(points):
    return lambda path: trimesh.PointCloud(points).export(path)


def ascii_cloud(rows, properties="xyz"):
    head = "\n".join(
        ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *(f"property float {p}" for p in properties)]
    )
    return lambda path: path.write_text("\n".join([head, "end_header", *(" ".join(map(str, row)) for row in rows), ""]))


def pcd(rows):
    head = f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {len(rows)}\nHEIGHT 1\n"
    head += f"POINTS {len(rows)}\nDATA ascii\n"
    return lambda path: path.write_text(head + "".join(" ".join(map(str, row)) + "\n" for row in rows))


CLOUDS = {
    "empty.ply": ascii_cloud([]),
    "nothing.ply": lambda path: path.touch(),
    "one.ply": cloud(POINTS[:1]),
    "few.ply": cloud(POINTS[:63]),
    "nan.ply": ascii_cloud([*POINTS[1:], ("nan", 0, 0)]),
    "two.ply": ascii_cloud(POINTS[:, :2], "xy"),
    "wide.ply": ascii_cloud([(1051, *row) for row in POINTS]),
    "same.ply": ascii_cloud([(1, 2, 3)] * 200),
    "huge.ply": ascii_cloud(POINTS * 1e30),
    "metres.ply": cloud(POINTS / 1000),
    "giant.ply": lambda path: path.open("wb").truncate(5 * 10**9),
    "device.ply": lambda path: path.symlink_to("/dev/zero"),
    "folder.ply": lambda path: path.mkdir(),
    "nan.pcd": pcd([*POINTS[1:], ("nan", 0, 0)]),
    "two.pcd": pcd(POINTS[:, :2]),
    "points.txt": lambda path: np.savetxt(path, POINTS),
    "two.npy": lambda path: np.save(path, POINTS[:, :2]),
    "objects.npy": lambda path: np.save(path, np.array([{}] * 99), allow_pickle=True),
    "pickle.npz": lambda path: np.savez(path, points=np.array([{}] * 99)),
    "wide.npz": lambda path: np.savez(path, first=POINTS, second=POINTS),
    "nan.xyz": lambda path: np.savetxt(path, np.where(POINTS > 60, np.nan, POINTS)),
    "words.csv": lambda path: path.write_text("a,b,c\n1,2,3\n"),
    "odd.bin": lambda path: path.write_bytes(bytes(1001)),
    "scan.las": lambda path: path.write_bytes(b"LASF"),
    "scene.glb": lambda path: path.write_bytes(BALL.export(file_type="glb")[:500]),
}


@pytest.mark.parametrize(("name", "role"), [(name, i % 2) for i, name in enumerate(CLOUDS)])
def test_points_that_cannot_be_explained_are_refused(name, role, folder):
    CLOUDS[name](folder / name)
    files = ["ball.ply", "ball.ply"]
    files[role] = name
    refusal(["explain", *files, *EXPLAIN[3:]], folder, name)


POSES = {
    "empty": "",
    "short": "1 0 0 0",
    "words": "one " * 16,
    "nan": "nan " * 16,
    "mirrored": "-1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1",
    "scaled": "2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 1",
    "last row": "1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 2",
    "giant": "0 " * 10**6,
}


@pytest.mark.parametrize("fault", POSES)
def test_a_start_that_is_no_pose_is_refused(fault, folder):
    (folder / "pose.txt").write_bytes(POSES[fault].encode("utf-8", "surrogateescape"))
    refusal([*EXPLAIN, "--init", "pose.txt"], folder, "pose.txt")
