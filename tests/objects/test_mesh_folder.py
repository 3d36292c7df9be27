import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.objects.mesh_folder import SUFFIXES, files_in, from_entry, meters_per, surfaces

BOX = trimesh.creation.box((10.0, 20.0, 30.0))
XYZ = "property float x\nproperty float y\nproperty float z\n"
FACES = "property list uchar int vertex_indices\n"


def ascii_ply(vertices, faces=(), normals=None):
    rows = vertices if normals is None else np.hstack([vertices, normals])
    header = f"ply\nformat ascii 1.0\ncomment element vertex 7\nelement vertex {len(rows)}\n{XYZ}"
    header += "" if normals is None else XYZ.replace("float ", "float n")
    header += f"element face {len(faces)}\n{FACES}" if len(faces) else ""
    lines = [" ".join(map(str, row)) for row in rows] + [" ".join(map(str, (len(f), *f))) for f in faces]
    return (header + "end_header\n" + "\n".join(lines) + "\n").encode()


def exported(kind):
    data = {
        "binary.ply": lambda: BOX.export(file_type="ply", encoding="binary"),
        "ascii.ply": lambda: ascii_ply(np.asarray(BOX.vertices), np.asarray(BOX.faces)),
        "quads.ply": lambda: ascii_ply(
            np.asarray(BOX.vertices),
            [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)],
        ),
        "plain.obj": lambda: BOX.export(file_type="obj"),
        "binary.stl": lambda: BOX.export(file_type="stl"),
        "ascii.stl": lambda: BOX.export(file_type="stl_ascii"),
        "plain.off": lambda: BOX.export(file_type="off"),
    }[kind]()
    return data.encode() if isinstance(data, str) else data


KINDS = ("binary.ply", "ascii.ply", "quads.ply", "plain.obj", "binary.stl", "ascii.stl", "plain.off")


def read(path, unit="mm"):
    return next(surfaces([path], unit))


@pytest.mark.parametrize("kind", KINDS)
def test_every_format_gives_the_same_box(kind, tmp_path):
    path = tmp_path / kind
    path.write_bytes(exported(kind))
    surface = read(path)
    assert surface.name == kind.split(".")[0]
    assert surface.vertices_m.dtype == np.float64
    assert surface.faces.dtype == np.int64
    mesh = trimesh.Trimesh(surface.vertices_m, surface.faces)
    assert mesh.extents == pytest.approx([0.01, 0.02, 0.03], rel=1e-6)
    assert mesh.area == pytest.approx(BOX.area * 1e-6, rel=1e-6)


def test_obj_with_two_materials_is_one_mesh(tmp_path):
    path = tmp_path / "two.obj"
    path.write_text("mtllib none.mtl\nv 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\n")
    surface = read(path, "m")
    assert trimesh.Trimesh(surface.vertices_m, surface.faces).area == pytest.approx(1)


def test_ply_without_faces_is_a_cloud(tmp_path):
    vertices, normals = np.random.default_rng(0).normal(size=(2, 70, 3))
    path = tmp_path / "cloud.ply"
    path.write_bytes(ascii_ply(vertices))
    surface = read(path, "cm")
    assert surface.faces is None
    assert surface.normals is None
    assert surface.vertices_m == pytest.approx(vertices / 100)
    path.write_bytes(ascii_ply(vertices, normals=2 * normals))
    assert read(path).normals == pytest.approx(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    normals[4] = 0
    path.write_bytes(ascii_ply(vertices, normals=normals))
    with pytest.raises(InputError, match=r"cloud\.ply.*normal"):
        read(path)


# An OBJ declares no counts: one that ends after some faces is whole for all that can be known.
TRUNCATED = [
    (kind, kept) for kind in KINDS for kept in (0.0, 0.2, 0.5, 0.8, 0.97) if kind != "plain.obj" or kept <= 0.5
]


@pytest.mark.parametrize(("kind", "kept"), TRUNCATED)
def test_truncated(kind, kept, tmp_path):
    content = exported(kind)
    path = tmp_path / kind
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match=kind):
        read(path)


@pytest.mark.parametrize("cut", [9, 20, 800])
def test_truncated_cloud(cut, tmp_path):
    path = tmp_path / "cloud.ply"
    path.write_bytes(ascii_ply(np.full((70, 3), 0.12345))[:-cut])
    with pytest.raises(InputError, match=r"cloud\.ply: is truncated"):
        read(path)


BROKEN = {
    "none.ply": (ascii_ply(np.zeros((0, 3))), "no points"),
    "nan.ply": (ascii_ply([(0, 0, 0), (0, "nan", 0), (1, 0, 0)], [(0, 1, 2)]), "NaN"),
    "inf.obj": (b"v 0 0 0\nv 0 inf 0\nv 1 0 0\nf 1 2 3\n", "NaN or infinity"),
    "wild.ply": (ascii_ply([(0, 0, 0), (0, 1, 0), (1, 0, 0)], [(0, 1, 3)]), "refers to a missing vertex"),
    "wild.obj": (b"v 0 0 0\nv 0 1 0\nv 1 0 0\nf 1 2 9\n", "readable"),
    "points.obj": (b"v 0 0 0\nv 0 1 0\nv 1 0 0\n", "no faces"),
    "text.ply": (b"hello\n", "readable"),
    "text.stl": (b"hello\n", "neither begins"),
    "text.off": (b"hello\n", "readable"),
    "underline.off": (b"OFF\n3 1 0\n1_0 0 0\n0 1 0\n0 0 1\n3 0 1 2\n", "'1_0' is not a finite decimal number"),
    "digits.off": ("OFF\n3 1 0\n٣ 0 0\n0 1 0\n0 0 1\n3 0 1 2\n".encode(), "'٣' is not a finite decimal number"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_file_is_named(name, tmp_path):
    content, message = BROKEN[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=f"{name}.*{message}"):
        read(tmp_path / name)


def test_files_in(tmp_path):
    for name in ("b.ply", "a.PLY", "c.obj", "notes.txt", "sub/d.ply"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    names = lambda patterns: [str(p.relative_to(tmp_path)) for p in files_in(tmp_path, patterns, SUFFIXES)]  # noqa: E731
    assert names(None) == ["a.PLY", "b.ply", "c.obj"]
    assert names(["sub/*.ply", "b.ply", "?.ply"]) == ["b.ply", "sub/d.ply"]
    for patterns, message in ((["b.ply", "x*.ply"], r"x\*\.ply: no file matches"), (["*.txt"], "notes.txt.*format")):
        with pytest.raises(InputError, match=message):
            names(patterns)


def test_missing_and_empty_folder_and_unit(tmp_path):
    with pytest.raises(InputError, match="nowhere: no such folder"):
        files_in(tmp_path / "nowhere", None, SUFFIXES)
    with pytest.raises(InputError, match=f"{tmp_path}: the folder has none of"):
        from_entry({"unit": "m"}, tmp_path)
    assert (meters_per("m"), meters_per("cm"), meters_per("mm")) == (1, 0.01, 0.001)
    for unit in ("inch", None):
        with pytest.raises(InputError, match="set unit"):
            meters_per(unit)
