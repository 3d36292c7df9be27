"""Step ``register_scans``: pairs of scans registered by every method.

Local methods start from a rung of the ladder, and from the pose of a global method.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method, require_global
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.process.environment import open3d_cloud, require_open3d
from gpca.process.progress import progress
from gpca.rigid import inverse, rotation_angle_rad, scale_translation
from gpca.scans.pair import Rung, ScanPair, disturbed, overlap_rmse, rungs_of, voxels
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds, Distinct, fields_of, read_settings
from gpca.steps.registration_trials import attempts, timed

if TYPE_CHECKING:
    import pandas as pd

NORMAL_VOXELS, NORMAL_NEIGHBORS = 2, 30  # radius and most neighbors, as Open3D's tutorial has them for such scans


@dataclass(frozen=True, kw_only=True)
class TrialSettings:
    """How the pairs are registered. Meters are those of a room: objects are enlarged to the size of a fragment of one.

    Attributes:
        voxel_m: both scans are thinned to the mean of the points in each voxel,
        points: and then to this number at most, drawn at random.
        ladder: disturbances of the true pose from which local methods start: a pair starts on one rung.
        global_start: the global method at whose pose local methods start a second time.
    """

    voxel_m: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)] = 0.05
    points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 5000
    ladder: Distinct[Rung] = (Rung(0, 0),)
    global_start: str = "fgr"


def run(job: Job) -> None:
    """Register the pairs of one data set and seed."""
    settings = read_settings(TrialSettings, fields_of(job.section("scans"), TrialSettings))
    methods = job.by_name("methods", job.methods)
    with record_provenance([*job.rows, *job.timings], [job.scans], job.settings, seed=job.seed):
        pairs = ScanPairs.load(job.scans, (job.source, job.seed))
        trials = try_methods(pairs, job.source, job.seed, methods, settings)
        for rows, out, timings in zip(trials.values(), job.rows, job.timings, strict=True):
            write_csv(out, rows.drop(columns="seconds"))
            write_csv(timings, rows[["sample", "start", "seconds"]])


def try_methods(
    pairs: ScanPairs, name: str, seed: int, methods: Mapping[str, Mapping], settings: TrialSettings
) -> dict[str, pd.DataFrame]:
    """Rows of pairs and starts of the data set `name` with the seconds of each trial, by method.

    The global start is among the methods, which are given with their settings. Normals are estimated beforehand. Each
    method is called once before the first pair, so that no trial includes what a method loads or compiles. Raises
    InputError for an unknown method or setting, a missing package, or a global start that is none or not among them.
    """
    import pandas as pd

    made = {method: make_method(method, entry) for method, entry in methods.items()}
    require_global(start := settings.global_start)
    if start not in made:
        raise InputError("scans.global_start", f"'{start}' is not among the methods", "add it or name another")
    records: dict[str, list[dict]] = {method: [] for method in made}
    rungs = rungs_of(len(pairs), settings.ladder, name, seed)
    for k, pair in enumerate(progress(pairs, f"registration of scans of {name}, seed {seed}")):
        rung = rungs[k]
        given = pair_to_register(pair, rung, settings, name, seed)
        if k == 0:
            for method in made.values():
                method(given)
        keys = {"sample": k, "pair": pair.name, "cluster": pair.cluster, "kind": pair.kind, "size_m": pair.size_m}
        keys |= {"overlap": pair.overlap, "rung": rung.name}
        coarse = timed(made[start], given)
        for method_name, align in made.items():
            for started_at, outcome, seconds in attempts(method_name, align, given, start, coarse):
                T_target_source = scale_translation(outcome.T_target_source, pair.scale)
                row = keys | {"start": started_at} | errors_of(pair, T_target_source)
                row |= {key: getattr(outcome, key) for key in ("fitness", "inlier_rmse", "failure")}
                records[method_name].append(row | {"seconds": seconds})
    return {method: pd.DataFrame(rows) for method, rows in records.items()}


def pair_to_register(pair: ScanPair, rung: Rung, settings: TrialSettings, *axes: object) -> Pair:
    """Input of a method: thinned scans in the meters of a room, with normals, started on a rung."""
    clouds, normals = {}, {}
    for role, points, viewpoint in (
        ("source", pair.source_N_3, pair.source_viewpoint_3),
        ("target", pair.target_M_3, pair.target_viewpoint_3),
    ):
        points_n_3 = voxels(points / pair.scale, settings.voxel_m)
        if len(points_n_3) > settings.points:
            kept = generator(*axes, pair.name, role, "clouds").permutation(len(points_n_3))[: settings.points]
            points_n_3 = points_n_3[np.sort(kept)]
        clouds[role] = points_n_3
        seen_from = None if viewpoint is None else viewpoint / pair.scale
        normals[role] = scan_normals(points_n_3, NORMAL_VOXELS * settings.voxel_m, seen_from)
    T_init = scale_translation(disturbed(pair, rung, *axes), 1 / pair.scale)
    draws = seed_of(*axes, pair.name, "draws")
    return Pair(clouds["source"], clouds["target"], T_init, normals["source"], normals["target"], draws)


def scan_normals(points_N_3: np.ndarray, radius: float, viewpoint_3: np.ndarray | None) -> np.ndarray:
    """Unit normals (N, 3) that point to the sensor, or away from the middle where its position is unknown.

    The radius is that of the neighbors, in the unit of the points; the viewpoint is in their frame.
    """
    cloud = open3d_cloud(points_N_3)
    cloud.estimate_normals(require_open3d().geometry.KDTreeSearchParamHybrid(radius, NORMAL_NEIGHBORS))
    normals_N_3 = np.array(cloud.normals)
    ahead_N_3 = points_N_3 - points_N_3.mean(axis=0) if viewpoint_3 is None else viewpoint_3 - points_N_3
    behind_N = np.einsum("ni,ni->n", normals_N_3, ahead_N_3) < 0
    return np.where(behind_N[:, None], -normals_N_3, normals_N_3)


def errors_of(pair: ScanPair, T_target_source: np.ndarray) -> dict[str, float]:
    """RMSE over the true overlap (m), and errors of rotation (rad) and translation (m)."""
    return {
        "rmse_m": overlap_rmse(pair, T_target_source),
        "rotation_error_rad": rotation_angle_rad(inverse(pair.T_target_source) @ T_target_source),
        "translation_error_m": float(np.linalg.norm(T_target_source[:3, 3] - pair.T_target_source[:3, 3])),
    }
