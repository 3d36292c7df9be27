"""The clouds of a user's registration: read, checked, brought into the target's frame, compared with training."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.errors import InputError, refusing
from gpca.io.files import require_file
from gpca.numerals import decimal
from gpca.objects import mesh_folder, point_files
from gpca.objects.canonical import CanonicalFrame, bounding_center, canonical_cloud, require_cloud_points, thin
from gpca.objects.sizes import IN_PYTHON, extent, require_sizes
from gpca.objects.surface import as_points, in_unit, measured
from gpca.rigid import require_rigid, rigid_motion, transform
from gpca.seeds import generator

if TYPE_CHECKING:
    from gpca.alignment.batched_icp import AnyICP

SAMPLED_POINTS = 16384  # points sampled on a mesh, as on the training objects
LARGEST_POSE_BYTES = 10**5  # 16 numbers in any notation
POSES = (
    "give 4×4 or 3×4 numbers of T_target_source, row by row, or one line of TUM, [time] tx ty tz qx qy qz qw, as text "
    "or npy"
)
SUFFIXES = (*mesh_folder.SUFFIXES, ".pcd", *point_files.TABLE_READERS)
UNIT_QUATERNION = 1e-3  # largest error of its length
FARTHEST_START = 10.0  # largest distance from the target's center to the source, in diameters of the target
MEASURES = ("size", "depth", "closure")
SHARE = 0.99  # share of the training samples within the range of each measure
SIZE_MARGIN = 1.1  # tolerance of the range of sizes: a sensor may show slightly less or more of an object
POINTS = 1024  # maximum number of points for hidden shares
DIRECTIONS = 32  # number of viewing directions
CELL, CELLS = 1 / 16, 64  # size of a picture's cell in diameters, and cells along an axis
BEHIND = 0.1  # depth behind the foremost point of a cell, in diameters, from which a point is hidden
FLAT = 0.15  # closure below which a thin object looks like one of its sides
FEWEST_MATCHES = 3  # with fewer points near the target, any rotation fits
FOREIGN = 2.0  # factor beyond the range of training sizes at which the scale must be wrong
BULK = 0.98  # share of the target's points that have to span at least ...
SMALLEST_BULK = 0.5  # ... this share of its diameter, the unit of all lengths


def require_format(path: Path) -> None:
    require_file(path, "no such file", f"give one of {', '.join(SUFFIXES)}")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(path, "has an unsupported format", f"give one of {', '.join(SUFFIXES)}")


def read_points(path: Path) -> np.ndarray:
    """Read a cloud of any size, or sample a mesh: points (N, 3) in the file's unit, with rows without a measurement."""
    return _read(path)[0]


def read_target(path: Path) -> tuple[np.ndarray, CanonicalFrame]:
    """Read as :func:`read_points` does, and return the canonical frame, too."""
    points, frame = _read(path)
    return points, frame or CanonicalFrame.of(measured(points, path), None, path)


def _read(path: Path) -> tuple[np.ndarray, CanonicalFrame | None]:
    require_format(path)
    suffix, frame = path.suffix.lower(), None
    if suffix == ".pcd":
        points = point_files.parse_pcd(path.read_bytes(), path)
    elif suffix not in mesh_folder.SUFFIXES:
        points = point_files.read_table(path)
    else:
        surface = mesh_folder.read_surface(path, 1.0)
        points = surface.vertices_m
        if surface.faces is not None:  # sampled at unit extent, because sampling limits the size of meshes
            size = extent(points) or 1.0
            points, _, diameter = canonical_cloud(replace(surface, vertices_m=points / size), "mesh", SAMPLED_POINTS)
            frame = CanonicalFrame(bounding_center(surface), size * diameter)
            points = size * points.astype(np.float64) + frame.center_3
    require_cloud_points(measured(points, path), path)
    return points, frame


def read_pose(path: Path) -> np.ndarray:
    """Read a pose (4, 4) in one of the forms of `POSES`; text may have comments (#), commas and brackets."""
    require_file(path, "no such file", POSES, LARGEST_POSE_BYTES)
    if path.suffix.lower() == ".npy":
        with refusing(path, "is not a readable .npy file ({})", POSES):
            array = np.load(path, allow_pickle=False).astype(np.float64)
        lengths, numbers = array.shape[-1:], array.ravel()
    else:
        with refusing(path, "is no text ({})", POSES):
            text = path.read_text(encoding="utf-8")
        lines = [re.sub(r"[\[\](),;]", " ", line.partition("#")[0]).split() for line in text.splitlines()]
        lengths = tuple({len(line) for line in lines if line})
        try:
            numbers = np.array([decimal(word) for line in lines for word in line])
        except ValueError as fault:
            raise InputError(path, f"contains something that is not a number: {fault}", POSES) from fault
    T_target_source = np.eye(4)
    if len(numbers) in (12, 16) and not {7, 8} & {*lengths}:
        T_target_source[: len(numbers) // 4] = numbers.reshape(-1, 4)
    elif lengths == (len(numbers),) and len(numbers) in (7, 8):
        *shift_3, x, y, z, w = numbers[-7:]
        if not abs(np.linalg.norm((x, y, z, w)) - 1) < UNIT_QUATERNION:
            raise InputError(path, "its last four numbers, qx qy qz qw, are no unit quaternion", POSES)
        from scipy.spatial.transform import Rotation

        T_target_source = rigid_motion(Rotation.from_quat((x, y, z, w)).as_matrix(), shift_3)
    else:
        rows = f" in lines of {' or '.join(map(str, sorted(lengths)))}" if len(numbers) in (12, 14, 16) else ""
        raise InputError(path, f"contains {len(numbers)} numbers{rows}", POSES)
    require_rigid(T_target_source, path)
    return T_target_source


@dataclass(frozen=True)
class Clouds:
    """The two clouds of a registration, and its ICP."""

    seen: np.ndarray  # (N, 3) the given source, thinned
    T_target_source_init: np.ndarray  # initial pose of ICP, in the user's unit
    frame: CanonicalFrame  # canonical frame of the target
    source: np.ndarray  # (N, 3) in that frame, at its initial pose
    target: np.ndarray  # (P, 3) in that frame
    icp: AnyICP  # ICP to that target

    @classmethod
    def prepared(
        cls,
        source_points: np.ndarray,
        target_points: np.ndarray,
        T_target_source_init: np.ndarray | None,
        unit: str,
        frame: CanonicalFrame | None,
        cloud_points: int,
        settings: ICPSettings,
        notes: list[str],
        source_unit: str | None = None,
    ) -> Clouds:
        """Check a user's clouds and bring them into the target's frame; see :meth:`gpca.Explainer.explain`."""
        from gpca.alignment.batched_icp import icp_to

        source, target = as_points(source_points, "source", notes), as_points(target_points, "target", notes)
        T_init = np.eye(4) if T_target_source_init is None else np.array(T_target_source_init, np.float64)
        require_rigid(T_init, "initial pose")
        require_cloud_points(source, "source")
        frame = frame or CanonicalFrame.of(target, None)
        units = source_unit or unit, unit
        require_sizes(("source", "target"), (extent(source), extent(target)), frame.diameter, units, IN_PYTHON)
        source = in_unit(source, source_unit, unit)
        target = frame.coordinates(_thinned(target, cloud_points, "target", notes))
        seen = _thinned(source, cloud_points, "source", notes)
        source = frame.coordinates(transform(T_init, seen))
        distance = float(np.linalg.norm(source, axis=1).min())
        if T_target_source_init is not None and distance > FARTHEST_START:
            fault = f"puts the source {distance:.3g} diameters of the target away from it"
            raise InputError("initial pose", fault, f"give T_target_source, with its translation in {unit}")
        return cls(seen, T_init, frame, source, target, icp_to(target, settings))


def _thinned(points: np.ndarray, cloud_points: int, role: str, notes: list[str]) -> np.ndarray:
    kept = thin(points, cloud_points, role)
    if len(kept) < len(points):
        notes.append(f"{role}: {len(kept)} of {len(points)} points, drawn at random")
    return kept


def measure(source: np.ndarray, target: np.ndarray) -> dict[str, float]:
    """Return `MEASURES` in diameters: ratios of radii of gyration and of hidden shares, NaN if thin; closure."""
    closure = hidden_share(target)
    depth = hidden_share(source) / closure if closure >= FLAT else np.nan
    return {"size": relative_size(source, target), "depth": float(depth), "closure": closure}


def relative_size(source: np.ndarray, target: np.ndarray) -> float:
    radii = [np.sqrt(cloud.var(axis=0).sum()) for cloud in (source, target)]
    return float(radii[0] / radii[1])


def hidden_share(points: np.ndarray) -> float:
    """Return the share of points (N, 3) hidden behind others, from the direction that hides the fewest."""
    points = points[generator("familiarity").permutation(len(points))[:POINTS]] - points.mean(axis=0)
    # Viewing directions are spread evenly over the sphere (Fibonacci); u and v span the picture.
    steps = np.arange(DIRECTIONS) + 0.5
    height, turn = 1 - 2 * steps / DIRECTIONS, np.pi * (1 + np.sqrt(5)) * steps
    ring = np.sqrt(1 - height**2)
    z_D_3 = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    u_D_3 = np.stack([-np.sin(turn), np.cos(turn), np.zeros(DIRECTIONS)], axis=1)
    frames_D_3_3 = np.stack([z_D_3, u_D_3, np.cross(z_D_3, u_D_3)], axis=1)
    z_D_N, u_D_N, v_D_N = np.moveaxis(frames_D_3_3 @ points.T, 1, 0)
    cell_D_N = [np.clip((w_D_N / CELL).astype(int) + CELLS // 2, 0, CELLS - 1) for w_D_N in (u_D_N, v_D_N)]
    number_D_N = (np.arange(DIRECTIONS)[:, None] * CELLS + cell_D_N[0]) * CELLS + cell_D_N[1]
    foremost = np.full(DIRECTIONS * CELLS**2, -np.inf)
    np.maximum.at(foremost, number_D_N, z_D_N)
    return float((z_D_N < foremost[number_D_N] - BEHIND).mean(axis=1).min())


@dataclass(frozen=True)
class Familiarity:
    """The range (low, high) of each measure over the training samples: it contains at least `SHARE` of them."""

    ranges: Mapping[str, tuple[float, float]]

    @classmethod
    def of(cls, pairs: Iterable[tuple[np.ndarray, np.ndarray]]) -> Familiarity:
        """Measure the training samples."""
        measured = [measure(*pair) for pair in pairs]
        ranges = {}
        for name in MEASURES:
            values = np.array([measures[name] for measures in measured])
            values = values[np.isfinite(values)]
            tails = (1 - SHARE) / 2, (1 + SHARE) / 2
            low, high = np.quantile(values, tails).tolist() if len(values) else (0.0, np.inf)
            margin = SIZE_MARGIN if name == "size" else 1.0
            ranges[name] = low / margin, high * margin
        return cls(ranges)

    def warnings(self, source: np.ndarray, target: np.ndarray) -> tuple[list[str], list[str]]:
        """Return lines for measures of the pair outside their range, of any explanation and of GP-CA's alone."""
        measured = measure(source, target)
        below = {name for name, (low, _) in self.ranges.items() if measured[name] < low}
        above = {name for name, (_, high) in self.ranges.items() if measured[name] > high}
        between = " to ".join(f"{end:.2g}" for end in self.ranges["size"])
        any_pair, gpca_alone = [], []
        if "size" in below | above:
            times = f"{measured['size']:.2g} times as large as the target; in training it was {between} times"
            any_pair.append(f"the source is {times}: are both in the same unit and scale?")
        if "closure" in below:
            any_pair.append("the target looks like a view from one side: give the whole object")
        if "depth" in above:
            gpca_alone.append("the source shows the object from all sides; GP-CA was trained on partial views")
        if "depth" in below:
            shown = "the source shows the object from one side alone"
            gpca_alone.append(f"{shown}; GP-CA was trained on clouds that show more")
        return any_pair, gpca_alone


def voids_of(source: np.ndarray, target: np.ndarray, fitness: float, familiar: Familiarity) -> dict[str, str]:
    """Return faults of the pair for which its scores mean nothing: a line -> what the user should check."""
    check_of = {}
    if (matches := round(fitness * len(source))) < FEWEST_MATCHES:
        ended = f"only {matches} of the source's points" if matches else "no source point"
        check_of[f"{ended} ended near the target"] = "the initial pose and the unit"
    low, high = familiar.ranges["size"]
    if not low / FOREIGN <= relative_size(source, target) <= high * FOREIGN:
        check_of["source and target differ in scale"] = "the unit and scale of both"
    # Twice the radius about the median that contains the share `BULK` of the points.
    bulk = 2 * float(np.quantile(np.linalg.norm(target - np.median(target, axis=0), axis=1), BULK))
    if bulk < SMALLEST_BULK:
        span = f"{BULK:.0%} of the target's points span {bulk:.2g} of its diameter"
        check_of[span] = "the target for points far from the object"
    return {f"{fault}, so the scores are meaningless: check {check}": check for fault, check in check_of.items()}
