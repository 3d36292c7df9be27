"""Make the folders ycb, ycbv, lm, lmo and estimates of this folder, and SHA256SUMS, from a folder of the originals.

    python data/make_data.py ORIGINALS
    python data/make_data.py --checksums    # SHA256SUMS alone, after a change to a text or a split

ORIGINALS has the layout that the datasheet (README.md) describes under "Collection". What is written depends on it
alone, to the byte. Hand-written files (README.md, VERSION, splits/, the licences) stay as they are.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

HERE = Path(__file__).parent
MM_PER_M = 1000.0
DEVELOPMENT_FACES = 4000  # of a development mesh: what decimation moves is below the scanner's noise
LM_WITHOUT = (3,)  # the bowl, of which the originals have no mesh
SCENES = {"ycbv": (0, 1, 2, 48, 49, 50, 51, 54), "lm": (6,), "lmo": (2,)}
# Frames of which a figure may show the colors: one for each scene that is tested.
COLORED = {"ycbv": ((48, 1), (49, 1), (50, 4), (51, 2), (54, 5)), "lm": ((6, 0),), "lmo": ((2, 3),)}
NESTED_CUPS = "065-"  # objects of `coffee_cup`, so at full resolution
ESTIMATES = ("ycbv_*.csv", "lmo_*.csv")


def main(originals: Path) -> None:
    """Write every generated file anew."""
    scans = sorted((originals / "ycb").glob("*.ply"))
    for folder in ("ycb", "ycbv", "lm", "lmo"):
        for path in generated(HERE / folder):
            path.unlink()
    write_bop_models(originals / "bop" / "ycbv" / "models", HERE / "ycbv" / "models")
    write_bop_models(originals / "bop" / "lm" / "models", HERE / "lm" / "models")
    in_ycbv = write_scan_frames(scans, HERE / "ycbv" / "models")
    write_scans([scan for scan in scans if scan.stem not in in_ycbv], HERE / "ycb")
    for dataset, scenes in SCENES.items():
        for scene in scenes:
            place = Path("test") / f"{scene:06d}"
            write_scene(originals / "bop" / dataset / place, HERE / dataset / place, dict(COLORED[dataset]).get(scene))
    for pattern in ESTIMATES:
        for path in sorted((originals / "bop" / "estimates").glob(pattern)):
            copy(path, HERE / "estimates" / path.name)
    write_checksums()


def generated(folder: Path) -> Iterator[Path]:
    """Yield what an earlier call wrote below a folder: all but its texts."""
    return (path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix not in (".md", ".txt"))


def write_bop_models(source: Path, folder: Path) -> None:
    """Copy a dataset's models without normals, and their models_info.json."""
    for path in sorted(source.glob("obj_*.ply")):
        write_mesh(read_mesh(path), folder / path.name)
    copy(source / "models_info.json", folder / "models_info.json")


def write_scan_frames(scans: list[Path], models: Path) -> set[str]:
    """Write how the scanner's frame of each YCB-Video object lies in the model's, and return these objects' names.

    A scan has the vertices of its model in the same order, so that its mesh stands here only once.
    """
    frames = {}
    for path in sorted(models.glob("obj_*.ply")):
        vertices_mm = np.asarray(read_mesh(path).vertices)
        for scan in scans:
            scan_mm = MM_PER_M * np.asarray(read_mesh(scan).vertices)
            if len(scan_mm) == len(vertices_mm):
                T_model_scan, residual_mm = rigid_motion(scan_mm, vertices_mm)
                if residual_mm < 0.01:
                    frames[path.stem] = {"scan": scan.stem, "T_model_scan_mm": T_model_scan.round(6).tolist()}
    if len(frames) != len(list(models.glob("obj_*.ply"))):
        sys.exit(f"{models}: a model is no scan of {scans[0].parent}; compare the versions of the two")
    write_json(models / "scan_frames.json", frames)
    return {frame["scan"] for frame in frames.values()}


def rigid_motion(source_N_3: np.ndarray, target_N_3: np.ndarray) -> tuple[np.ndarray, float]:
    """Return T_target_source (4, 4) of corresponding points by least squares, and the largest distance that is left."""
    centers = source_N_3.mean(axis=0), target_N_3.mean(axis=0)
    U, _, Vt = np.linalg.svd((target_N_3 - centers[1]).T @ (source_N_3 - centers[0]))
    R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, centers[1] - R @ centers[0]
    return T, float(np.linalg.norm(source_N_3 @ R.T + T[:3, 3] - target_N_3, axis=1).max())


def write_scans(scans: list[Path], folder: Path) -> None:
    """Write the YCB scans that YCB-Video lacks, in millimeters; those for development with fewer faces."""
    for path in scans:
        mesh = read_mesh(path)
        mesh.apply_scale(MM_PER_M)
        write_mesh(mesh if path.stem.startswith(NESTED_CUPS) else decimated(mesh), folder / path.name)


def decimated(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a mesh of at most `DEVELOPMENT_FACES` faces, by quadric decimation (Garland and Heckbert 1997)."""
    import open3d as o3d  # here, as the checksums do without

    vertices, faces = o3d.utility.Vector3dVector(mesh.vertices), o3d.utility.Vector3iVector(mesh.faces.astype(np.int32))
    fewer = o3d.geometry.TriangleMesh(vertices, faces).simplify_quadric_decimation(DEVELOPMENT_FACES)
    return trimesh.Trimesh(np.asarray(fewer.vertices), np.asarray(fewer.triangles), process=False)


def write_scene(source: Path, folder: Path, colored: int | None) -> None:
    """Copy a scene's cameras, poses, depth and masks, and the color image of one frame as JPEG."""
    for name in ("scene_camera.json", "scene_gt.json", "scene_gt_info.json"):
        copy(source / name, folder / name)
    for kind in ("depth", "mask_visib"):
        for path in sorted((source / kind).iterdir()):
            copy(path, folder / kind / path.name)
    if colored is not None:
        path = next((source / "rgb").glob(f"{colored:06d}.*"))
        if path.suffix == ".jpg":
            copy(path, folder / "rgb" / path.name)
        else:
            (folder / "rgb").mkdir(parents=True, exist_ok=True)
            Image.open(path).convert("RGB").save(folder / "rgb" / f"{colored:06d}.jpg", quality=85)


def read_mesh(path: Path) -> trimesh.Trimesh:
    """Return a mesh as the file has it."""
    return trimesh.load(path, process=False, force="mesh")


def write_mesh(mesh: trimesh.Trimesh, path: Path) -> None:
    """Write vertices (float32) and faces as binary PLY."""
    faces = np.zeros(len(mesh.faces), [("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, mesh.faces
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + np.asarray(mesh.vertices, "<f4").tobytes() + faces.tobytes())


def copy(source: Path, path: Path) -> None:
    """Copy a file's content, not its permissions."""
    path.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, path)


def write_json(path: Path, content: object) -> None:
    """Write JSON that one can read."""
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def write_checksums() -> None:
    """Write SHA256SUMS, which `sha256sum -c` reads, of every other file of this folder."""
    paths = [path for path in sorted(HERE.rglob("*")) if path.is_file() and not is_left_out(path.relative_to(HERE))]
    lines = [f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(HERE)}\n" for path in paths]
    (HERE / "SHA256SUMS").write_text("".join(lines), encoding="utf-8")


def is_left_out(path: Path) -> bool:
    """Return whether a file is no part of the data: downloads, caches and the checksums themselves."""
    return path.parts[0] in ("downloads", "__pycache__", "SHA256SUMS", "make_data.py")


if __name__ == "__main__":
    if sys.argv[1:] == ["--checksums"]:
        write_checksums()
    elif len(sys.argv) == 2 and (Path(sys.argv[1]) / "bop").is_dir():
        main(Path(sys.argv[1]))
    else:
        sys.exit("usage: python data/make_data.py ORIGINALS, a folder with bop/ and ycb/ (README.md, Collection)")
