"""Readers of meshes, held to trimesh."""

import numpy as np
import pytest
import trimesh

from .test_mesh_folder import BALL, KINDS, MESHES_FACES, VERTICES, XYZ, exported, off, ply, read, stl_text

FACES_OF = {
    "triangles": BALL.faces,
    "quads": [(i, i + 1, i + 2, i + 3) for i in range(150)],
    "fans": [tuple(range(i, i + 6)) for i in range(150)],
    "mixed": [tuple(range(i, i + 3 + i % 4)) for i in range(150)],
}
CORNERS_OF = {  # of OBJ: vertex, texture, normal; numbers from the end
    "plain": "{0}",
    "textured": "{0}/{1}",
    "with_normals": "{0}//{2}",
    "with_both": "{0}/{1}/{2}",
    "backward": "{3}/{1}/{2}",
}


def faced_obj(corners, faces, materials):
    """An OBJ of polygons, which use its three materials by turns."""
    lines = [f"v {row}" for row in VERTICES] + ["vt 0 0"] * 9 + ["vn 0 0 1"] * 7
    for i, face in enumerate(faces):
        lines += [f"usemtl m{i // 40 % 3}"] * (materials and i % 40 == 0)
        words = [corners.format(v + 1, (v * i) % 9 + 1, (v + i) % 7 + 1, v - len(VERTICES)) for v in face]
        lines.append(f"f {' '.join(words)}")
    return "\n".join([*lines, ""]).encode()


def rich_ply(order, corner_kind, faces):
    """A binary PLY with normals, colors, another list and another element before the vertices."""
    head = f"ply\nformat binary_{'little' if order == '<' else 'big'}_endian 1.0\nelement camera 2\nproperty short id\n"
    head += f"element vertex {len(VERTICES)}\n{XYZ.replace('float', 'double')}{XYZ.replace('float ', 'float32 n')}"
    head += f"property uchar red\nelement face {len(faces)}\nproperty uchar red\nproperty list uint8 {corner_kind[0]} "
    head += "vertex_index\nproperty list int float texcoord\nend_header\n"
    vertex = np.dtype([("x", f"{order}f8", 3), ("n", f"{order}f4", 3), ("red", "u1")])
    corners = (corner_kind[1], len(faces[0]))
    lists = [
        ("count", "u1"),
        ("corners", order + corners[0], corners[1]),
        ("uvs", f"{order}i4"),
        ("uv", f"{order}f4", 6),
    ]
    rows = np.array([(1, len(face), face, 6, [0] * 6) for face in faces], [("red", "u1"), *lists])
    points = np.array([(point, point, 1) for point in np.array(BALL.vertices) / 3], vertex)
    return head.encode() + np.array([1, 2], f"{order}i2").tobytes() + points.tobytes() + rows.tobytes()


def like_trimesh():
    files = {kind: exported(kind) for kind in KINDS}
    for name, faces in FACES_OF.items():
        files[f"text_{name}.ply"] = ply(faces=[" ".join(map(str, (len(face), *face))) for face in faces]).encode()
        if name != "mixed":  # trimesh fails for such files
            files[f"text_{name}.off"] = off(faces=[" ".join(map(str, (len(f), *f))) for f in faces]).replace(
                f" {len(MESHES_FACES)} 0", f" {len(faces)} 0"
            ).encode()  # fmt: skip
        for corners, form in CORNERS_OF.items():
            for materials in (False, True):
                files[f"{corners}_{name}_{materials}.obj"] = faced_obj(form, faces, materials)
    for order in "<>":
        for kind in (("int", "i4"), ("ushort", "u2"), ("uint8", "u1")):
            files[f"rich_{kind[1]}_{'little' if order == '<' else 'big'}.ply"] = rich_ply(order, kind, BALL.faces)
    return files


LIKE_TRIMESH = {name: content for name, content in like_trimesh().items() if not name.endswith(".vtk")}  # it reads none


def triangles_of(vertices, faces):
    """Corners of the triangles, each from its first corner on, in sorted order."""
    corners = vertices[faces].round(9)
    turned = [min(np.roll(triangle, turn, axis=0).tolist() for turn in range(3)) for triangle in corners]
    return sorted(turned)


@pytest.mark.parametrize("name", LIKE_TRIMESH)
def test_a_mesh_has_the_triangles_that_trimesh_reads(name, tmp_path):
    (tmp_path / name).write_bytes(LIKE_TRIMESH[name])
    expected = trimesh.load(tmp_path / name, process=False, skip_materials=True, fix_texture=False)
    expected = expected.to_mesh() if isinstance(expected, trimesh.Scene) else expected
    surface = read(tmp_path / name, "m")
    assert triangles_of(surface.vertices_m, surface.faces) == triangles_of(expected.vertices, expected.faces)


def test_several_solids_and_polygons_of_several_lengths_are_read(tmp_path):
    (tmp_path / "two.stl").write_text(stl_text() + stl_text().replace("solid", "solid other"))
    assert len(read(tmp_path / "two.stl").triangles) == 2 * len(BALL.faces)
    faces = FACES_OF["mixed"]
    rows = [" ".join(map(str, (len(face), *face))) for face in faces]
    (tmp_path / "mixed.off").write_text(off(faces=rows).replace(f" {len(MESHES_FACES)} 0", f" {len(faces)} 0"))
    (tmp_path / "mixed.ply").write_text(ply(faces=rows, properties=XYZ.replace("float", "double")))
    for surface in (read(tmp_path / "mixed.off"), read(tmp_path / "mixed.ply")):
        assert np.array_equal(surface.faces, read(tmp_path / "mixed.ply").faces)
        assert len(surface.faces) == sum(len(face) - 2 for face in faces)
