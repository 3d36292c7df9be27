"""Mesh and cloud files that are damaged, or say what they do not hold, through the command line."""

import json
import re

import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.objects.mesh_folder import SUFFIXES, files_in, from_entry, read_surface
from gpca.objects.surface import meters_per

from ..hostile import refusal

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


QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
VTK_END = "POINT_DATA 8\nSCALARS heat float 1\nLOOKUP_TABLE default\n"


def vtk_text(vertices, faces=(), end=VTK_END):
    rows = [" ".join(map(str, row)) for row in vertices]
    cells = [" ".join(map(str, (len(face), *face))) for face in faces]
    size = len(" ".join(cells).split())
    head = f"# vtk DataFile Version 3.0\na box\nASCII\nDATASET POLYDATA\nPOINTS {len(rows)} double\n"
    cells = [f"POLYGONS {len(cells)} {size}", *cells] if cells else []
    return "\n".join([head + "  ".join(rows), *cells, end])


def vtk_binary(vertices, faces, version=3):
    """As VTK writes them: arrays among the head, and from version 5 on offsets instead of lengths."""
    head = f"# vtk DataFile Version {version}.1\na box\nBINARY\nDATASET POLYDATA\n"
    field = b"FIELD FieldData 1\ntime 1 1 double\n" + np.array([2.5], ">f8").tobytes() + b"\n"
    points = f"POINTS {len(vertices)} float\n".encode() + np.asarray(vertices, ">f4").tobytes()
    metadata = b"\nMETADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 1 2\n\n"
    if version == 5:
        offsets = np.arange(0, 3 * len(faces) + 1, 3).astype(">i8").tobytes()
        cells = f"POLYGONS {len(faces) + 1} {3 * len(faces)}\nOFFSETS vtktypeint64\n".encode() + offsets
        cells += b"\nCONNECTIVITY vtktypeint64\n" + np.asarray(faces, ">i8").tobytes()
    else:
        cells = f"POLYGONS {len(faces)} {4 * len(faces)}\n".encode()
        cells += np.column_stack([np.full(len(faces), 3), faces]).astype(">i4").tobytes()
    return head.encode() + field + points + metadata + cells + b"\n" + VTK_END.encode()


def exported(kind):
    data = {
        "binary.ply": lambda: BOX.export(file_type="ply", encoding="binary"),
        "ascii.ply": lambda: ascii_ply(np.asarray(BOX.vertices), np.asarray(BOX.faces)),
        "quads.ply": lambda: ascii_ply(np.asarray(BOX.vertices), QUADS),
        "plain.obj": lambda: BOX.export(file_type="obj"),
        "binary.stl": lambda: BOX.export(file_type="stl"),
        "ascii.stl": lambda: BOX.export(file_type="stl_ascii"),
        "plain.off": lambda: BOX.export(file_type="off"),
        "binary.glb": lambda: BOX.export(file_type="glb"),
        "ascii.vtk": lambda: vtk_text(BOX.vertices, BOX.faces),
        "quads.vtk": lambda: vtk_text(BOX.vertices, QUADS),
        "binary.vtk": lambda: vtk_binary(BOX.vertices, BOX.faces),
        "offsets.vtk": lambda: vtk_binary(BOX.vertices, BOX.faces, version=5),
    }[kind]()
    return data.encode() if isinstance(data, str) else data


KINDS = (
    *("binary.ply", "ascii.ply", "quads.ply", "plain.obj", "binary.stl", "ascii.stl", "plain.off", "binary.glb"),
    *("ascii.vtk", "quads.vtk", "binary.vtk", "offsets.vtk"),
)


def read(path, unit="mm"):
    return read_surface(path, meters_per(unit))


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


def test_meshes_of_several_materials_are_one_and_nodes_put_them_where_they_stand(tmp_path):
    path = tmp_path / "two.obj"
    path.write_text("mtllib none.mtl\nv 0 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 2 3 4\n")
    surface = read(path, "m")
    assert trimesh.Trimesh(surface.vertices_m, surface.faces).area == pytest.approx(1)
    scene, turned = trimesh.Scene(), trimesh.transformations.rotation_matrix(0.5, (1, 2, 3), (4, 5, 6))
    scene.add_geometry(BOX, node_name="a", transform=turned)
    scene.add_geometry(BOX, node_name="b", parent_node_name="a", transform=turned)
    (tmp_path / "two.glb").write_bytes(scene.export(file_type="glb"))
    surface = read(tmp_path / "two.glb", "m")
    expected = trimesh.transform_points(BOX.vertices, turned)
    both = np.r_[expected, trimesh.transform_points(expected, turned)]
    np.testing.assert_allclose(surface.vertices_m, both, atol=1e-4)
    assert trimesh.Trimesh(surface.vertices_m, surface.faces).area == pytest.approx(2 * BOX.area, rel=1e-5)


def test_ply_vtk_and_glb_without_faces_are_clouds(tmp_path, capsys):
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
    assert read(path).normals is None  # estimated where they are needed
    assert "cloud.ply: 1 of 70 normals are zero or NaN, so none of them is used" in capsys.readouterr().err
    points = np.random.default_rng(0).normal(size=(70, 3))
    (tmp_path / "cloud.vtk").write_text(vtk_text(points))
    trimesh.PointCloud(points).export(tmp_path / "cloud.glb")
    for name in ("cloud.vtk", "cloud.glb"):
        surface = read(tmp_path / name, "m")
        assert surface.faces is None
        np.testing.assert_allclose(surface.vertices_m, points, atol=1e-6)


# An OBJ declares no counts: one that ends after some faces is whole for all that can be known.
# So may one of VTK after its faces, since its values are not read.
TRUNCATED = [
    (kind, kept)
    for kind in KINDS
    for kept in (0.0, 0.2, 0.5, 0.8, 0.97)
    if kept <= 0.5 or (kind != "plain.obj" and not kind.endswith("vtk"))
]


@pytest.mark.parametrize(("kind", "kept"), TRUNCATED)
def test_truncated(kind, kept, tmp_path):
    content = exported(kind)
    path = tmp_path / kind
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(InputError, match=kind):
        read(path)


BROKEN = {
    "none.ply": (ascii_ply(np.zeros((0, 3))), "no points"),
    "nan.ply": (ascii_ply([(0, 0, 0), (0, "nan", 0), (1, 0, 0)], [(0, 1, 2)]), "NaN"),
    "inf.obj": (b"v 0 0 0\nv 0 inf 0\nv 1 0 0\nf 1 2 3\n", "NaN or infinity"),
    "wild.ply": (ascii_ply([(0, 0, 0), (0, 1, 0), (1, 0, 0)], [(0, 1, 3)]), "refers to a missing vertex"),
    "text.ply": (b"hello\n", "readable"),
    "grid.vtk": (vtk_text(BOX.vertices).replace("POLYDATA", "UNSTRUCTURED_GRID").encode(), "not 'DATASET POLYDATA'"),
    "strips.vtk": (vtk_text(BOX.vertices, BOX.faces).replace("POLYGONS", "TRIANGLE_STRIPS").encode(), "strips"),
    "wild.vtk": (vtk_text(BOX.vertices, [(0, 1, 8)]).encode(), "refers to a missing vertex"),
    "more.vtk": (vtk_text(BOX.vertices, QUADS).replace("POLYGONS 6", "POLYGONS 7").encode(), "6 cells stand where 7"),
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


BALL = trimesh.creation.icosphere(2, radius=50)
VERTICES = [" ".join(f"{x:.5f}" for x in vertex) for vertex in BALL.vertices]
MESHES_FACES = ["3 " + " ".join(map(str, face)) for face in BALL.faces]


def ply(vertices=VERTICES, faces=MESHES_FACES, n_vertices=None, n_faces=None, properties=XYZ):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(vertices) if n_vertices is None else n_vertices}\n{properties}"
    head += f"element face {len(faces) if n_faces is None else n_faces}\nproperty list uchar int vertex_indices\n"
    return "\n".join([f"{head}end_header", *vertices, *faces, ""])


def off(vertices=VERTICES, faces=MESHES_FACES, head="OFF"):
    return "\n".join([head, f"{len(VERTICES)} {len(MESHES_FACES)} 0", *vertices, *faces, ""])


def obj(vertices=VERTICES, faces=None):
    faces = BALL.faces + 1 if faces is None else faces
    return "\n".join([*(f"v {v}" for v in vertices), *("f " + " ".join(map(str, face)) for face in faces), ""])


def pcd(rows=("0.1 0.2 0.3",) * 70, data="ascii", **changes):
    head = {"FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": len(rows), "HEIGHT": 1}
    head |= {"POINTS": len(rows)} | changes
    text = "\n".join(f"{key} {value}" for key, value in head.items()) + f"\nDATA {data}\n"
    return text.encode() + (rows if isinstance(rows, bytes) else "\n".join([*rows, ""]).encode())


def compressed(points):
    body = np.array([len(BOMB), 12 * points], "<u4").tobytes() + BOMB
    return pcd(body, "binary_compressed", WIDTH=points, POINTS=points)


def changed(rows, row, index=5):
    return [*rows[:index], row, *rows[index + 1 :]]


def binary(spoil):
    content = bytearray(BALL.export(file_type="ply", encoding="binary"))
    spoil(content, content.index(b"end_header\n") + len(b"end_header\n"))
    return bytes(content)


def cornered(corners):
    """A binary PLY whose faces have as many corners."""
    face = np.dtype([("n", "u1"), ("corners", "<i4", (corners,))])
    faces = np.array([(corners, range(i, i + corners)) for i in range(150)], face)
    head = ply(n_faces=150).replace("ascii", "binary_little_endian").partition("end_header\n")
    return "".join(head[:2]).encode() + BALL.vertices.astype("<f4").tobytes() + faces.tobytes()


def stl(spoil):
    content = bytearray(BALL.export(file_type="stl"))
    spoil(content)
    return bytes(content)


def stl_text():
    return BALL.export(file_type="stl_ascii")


def write(content, start, new):
    content[start : start + len(new)] = new


NAN = np.float32(np.nan).tobytes()
LAST_LIST = -13  # bytes of a triangle
BOMB = b"\x00A" + b"\xe0\xff\x00" * 3_000_000  # LZF: each three bytes copy 264
MESHES = {
    # rows that are too wide: the coordinates would be others
    "one_wide.ply": ply(changed(VERTICES, f"1051 {VERTICES[5]}")),
    "list_too_long.ply": ply(faces=changed(MESHES_FACES, "4 1 2 3")),
    "two_corners.ply": ply(faces=changed(MESHES_FACES, "2 1 2")),
    "far_corner.ply": ply(faces=changed(MESHES_FACES, "3 1 2 162")),
    # counts
    "negative_count.ply": ply(n_vertices=-5),
    "huge_count.ply": ply(n_vertices=10**15),
    "two_axes.ply": ply([row.rsplit(" ", 1)[0] for row in VERTICES], properties=XYZ.replace("property float z\n", "")),
    "no_end.ply": ply()[:100],
    "vertices_twice.ply": ply().replace("element face", f"element vertex {len(VERTICES)}\n{XYZ}element face"),
    "x_twice.ply": ply([f"{row} 1" for row in VERTICES], properties=f"{XYZ}property float x\n"),
    "middle_endian.ply": binary(lambda content, start: write(content, 0, content[:40].replace(b"little", b"middle"))),
    "no_format.ply": binary(lambda content, start: write(content, 4, b"comment")),
    "two_corners_binary.ply": cornered(2),
    # numbers
    "huge.ply": ply([f"{row}e30" for row in VERTICES]),
    "one_point.ply": ply(["1 2 3"] * len(VERTICES)),
    "binary_list.ply": binary(lambda content, start: write(content, len(content) + LAST_LIST, b"\x04")),
    "binary_cut.ply": binary(lambda content, start: content.__delitem__(slice(len(content) - 130, None))),
    # OFF
    "more_rows.off": off(faces=[*MESHES_FACES, *MESHES_FACES]),
    # OBJ
    "index_0.obj": obj(faces=BALL.faces),
    "cut_between_faces.obj": obj(faces=BALL.faces[:160] + 1),
    "weights.obj": obj([f"1051 {row}" for row in VERTICES]),
    "zeros.obj": "\0" * 3_000_000,
    # STL
    "cut_between_faces.stl": "\n".join(stl_text().splitlines()[:351]),
    "count_too_low.stl": stl(lambda content: write(content, 80, (10).to_bytes(4, "little"))),
    "binary_cut.stl": stl(lambda content: content.__delitem__(slice(84 + 2000, None))),
    "two_vertices.stl": re.sub("vertex .*\n", "", stl_text(), count=1),
    "two_numbers.stl": re.sub(r"(vertex \S+ \S+) \S+", r"\1", stl_text(), count=1),
    "no_end.stl": stl_text().replace("endsolid", ""),
    "binary_nan.stl": stl(lambda content: write(content, 96, NAN)),
}
CLOUDS = {
    "one_place.pcd": pcd(),
    "empty.pcd": pcd(()),
    "two_columns.pcd": pcd(FIELDS="x y", SIZE="4 4", TYPE="F F", COUNT="1 1"),
    "nan.pcd": pcd(("nan 0 0",) * 70),
    "complex.pcd": pcd(("1+2j 0 0",) * 70),
    "huge_count.pcd": pcd(COUNT="1 1 99999999999"),
    "huge_width.pcd": pcd(WIDTH=10**15, POINTS=10**15),
    "bomb.pcd": compressed(6 * 10**7),
    "longer_than_said.pcd": compressed(70),
}

FAULTS = {
    "middle_endian.ply": "its format 'binary_middle_endian' is unknown",
    "no_format.ply": "its format '' is unknown",
    "vertices_twice.ply": "declares element vertex twice",
    "x_twice.ply": "declares property 'x' twice",
    "two_corners.ply": f"row 6 of {len(MESHES_FACES)} of element face has 2 corners",
    "two_corners_binary.ply": "element face has rows of 2 corners",
    "two_numbers.stl": "it is neither whole facets from 'solid' to 'endsolid'",
    "zeros.obj": "a line is longer than 1048576 bytes, so it is not text",
}


def arguments(kind, **options):
    settings = {"kind": kind, "location": ".", "unit": "mm"} | options
    return ["objects", "--source", "s", "--data-dir", ".", "--out", "objects.npz", "--settings", json.dumps(settings)]


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_that_is_not_what_it_says_is_refused(name, tmp_path):
    content = MESHES[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    refusal(arguments("mesh_folder"), tmp_path, name.split(".")[0], FAULTS.get(name, ""))


@pytest.mark.parametrize("name", CLOUDS)
def test_a_cloud_that_is_not_what_it_says_is_refused(name, tmp_path):
    (tmp_path / name).write_bytes(CLOUDS[name])
    refusal(arguments("uw_rgbd", unit="m"), tmp_path, name.split(".")[0])


def test_a_file_too_large_to_be_parsed_is_not_opened(tmp_path):
    for name, kind in (("sparse.ply", "mesh_folder"), ("sparse.pcd", "uw_rgbd")):
        with (tmp_path / name).open("wb") as file:
            file.truncate(5 * 10**9)
        refusal(arguments(kind, unit="m"), tmp_path, name, "is 5 GB, more than the limit of 1 GB")


@pytest.mark.parametrize("name", ["zeros.obj", "zeros.off", "zeros.stl", "zeros.ply"])
def test_more_text_than_can_be_parsed_is_not_read(name, tmp_path):
    heads = {".stl": b"solid\n", ".ply": b"ply\nformat ascii 1.0\nelement vertex 9\nend_header\n"}
    with (tmp_path / name).open("wb") as file:
        file.write(heads.get(name[-4:], b""))
        file.truncate(9 * 10**8)
    line = refusal(arguments("mesh_folder"), tmp_path, name, "has 900 MB of text, more than the limit of 250 MB")
    assert "truncated" not in line


def test_the_same_files_unspoilt_are_read(tmp_path):
    for name, content in {"ball.ply": ply(), "ball.off": off(), "ball.obj": obj()}.items():
        (tmp_path / name).write_text(content)
    (tmp_path / "back.obj").write_text(obj(faces=BALL.faces - 162))
    (tmp_path / "colours.off").write_text(off([f"{row} 255 0 0" for row in VERTICES], head="COFF"))
    (tmp_path / "ball.stl").write_text(stl_text())
    (tmp_path / "capitals.stl").write_text(stl_text().replace("solid", "Solid a b").replace("vertex", "  VERTEX"))
    (tmp_path / "two_solids.stl").write_text(stl_text() + "\n" + stl_text().replace("solid", "solid other"))
    (tmp_path / "binary.ply").write_bytes(binary(lambda content, start: None))
    (tmp_path / "binary.stl").write_bytes(stl(lambda content: None))
    for surface in from_entry({"unit": "mm"}, tmp_path):
        np.testing.assert_allclose(np.ptp(surface.vertices_m, axis=0), 0.1, atol=1e-6)
