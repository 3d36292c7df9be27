"""Make the clouds of this folder: a drill (procedural stand-in), and a noisy scan of its front that lies 75° off.

python examples/clouds/make.py
gpca explain examples/clouds/scan.ply examples/clouds/model.ply --png examples/clouds/explained.png
"""

from pathlib import Path

import numpy as np
import trimesh

from gpca.objects.procedural import surfaces
from gpca.rigid import exp, transform
from gpca.seeds import generator

NOISE_M, OUTLIERS = 0.001, 20
TURN_RAD, SHIFT_M = np.radians([10.0, 25.0, 70.0]), (0.02, -0.01, 0.015)  # of the scan, as a twist
TOWARD_CAMERA = np.array([0.3, -0.9, 0.3])


def main(folder: Path = Path(__file__).parent) -> None:
    draws = generator("example clouds")
    drill = next(surface for surface in surfaces("ycb") if surface.name == "035_power_drill")
    mesh = trimesh.Trimesh(drill.vertices_m, drill.triangles, process=False)
    points, faces = trimesh.sample.sample_surface(mesh, 16384, seed=0)
    normals = mesh.face_normals[faces]
    facing = normals @ TOWARD_CAMERA > 0
    scan = points[facing][:1500] + draws.normal(0, NOISE_M, (1500, 3))
    box = scan.min(axis=0), scan.max(axis=0)
    scan = np.concatenate([scan, draws.uniform(*box, (OUTLIERS, 3))])
    write_ply(folder / "model.ply", points[:6000])
    write_ply(folder / "scan.ply", transform(exp(np.concatenate([TURN_RAD, SHIFT_M])[None])[0], scan))


def write_ply(path: Path, points: np.ndarray) -> None:
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    path.write_bytes("\n".join([*head, "end_header\n"]).encode() + points.astype("<f4").tobytes())


if __name__ == "__main__":
    main()
