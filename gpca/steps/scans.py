"""The steps of scans: drawn pairs, and their registration by every method."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from gpca.alignment.methods.interface import Pair
from gpca.errors import InputError
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.process.environment import open3d_cloud, require_open3d
from gpca.process.progress import progress
from gpca.rigid import inverse, rotation_angle_rad, scale_translation
from gpca.scans.pair import Rung, ScanPair, disturbed, overlap_rmse, rungs_of, voxels
from gpca.scans.scene import ScanPairs, choose_pairs
from gpca.scans.source import entry_of, scenes_of
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds, Distinct, fields_of, read_settings
from gpca.steps.registration_trials import try_each, write_trials

NORMAL_VOXELS, NORMAL_NEIGHBORS = 2, 30  # radius and most neighbors, as Open3D's tutorial has them for such scans


@dataclass(frozen=True, kw_only=True)
class TrialSettings:
    """How the pairs are registered, in meters of a room: objects are enlarged to the size of a fragment of one."""

    voxel_m: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)] = 0.05  # whose points are replaced by their mean
    points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 5000  # of these means, drawn, at most
    ladder: Distinct[Rung] = (Rung(0, 0),)  # disturbances of the true pose; local methods start a pair on one of them
    global_start: str = "fgr"  # the global method at whose pose local methods start a second time


def draw_scans(job: Job) -> None:
    """Read or make the scenes of a data set of scans and draw pairs of each scene and stratum of overlap."""
    with record_provenance([job.out], job.get("data", []), job.settings, seed=job.seed):
        ScanPairs.of(drawn_pairs(job, job.section("choice"))).save(job.out, job.axes)


def drawn_pairs(job: Job, choice: Mapping[str, Any]) -> list[ScanPair]:
    """Pairs of a job's data set; `choice` has strata of overlap, most pairs of each, and points of a scan."""
    entry, place = entry_of(job.section("entry")), Path(job.place) if job.get("place") else None
    scenes = scenes_of(entry, place, job.settings["role"], choice["scan_points"])
    pairs = choose_pairs(scenes, choice["strata"], choice["pairs"], job.source, job.seed)
    if not pairs:
        fault = f"has no two scans that overlap by {choice['strata'][0]:g} or more"
        raise InputError(place or entry.title, fault, "check its poses and its unit")
    return pairs


def register(job: Job) -> None:
    settings = read_settings(TrialSettings, fields_of(job.section("scans"), TrialSettings))
    methods = job.by_name("methods", job.methods)
    with record_provenance([*job.rows, *job.timings], [job.scans], job.settings, seed=job.seed):
        pairs = ScanPairs.load(job.scans, job.axes)
        trials = try_methods(pairs, job.source, job.seed, methods, settings)
        write_trials(trials.values(), job.rows, job.timings)


def try_methods(
    pairs: ScanPairs, name: str, seed: int, methods: Mapping[str, Mapping], settings: TrialSettings
) -> dict[str, Frame]:
    """Rows of pairs and starts of the data set `name`, by method; see :func:`try_each`."""
    rungs = rungs_of(len(pairs), settings.ladder, name, seed)
    pair_of = lru_cache(maxsize=1)(pairs.__getitem__)
    given = lru_cache(maxsize=1)(lambda k: pair_to_register(pair_of(k), rungs[k], settings, name, seed))

    def asked(k: int, _method: str) -> tuple[Pair, dict]:
        of_pair = {key: getattr(pair_of(k), key) for key in ("cluster", "kind", "size_m", "overlap")}
        return given(k), {"sample": k, "pair": pair_of(k).name, **of_pair, "rung": rungs[k].name}

    def errors(k: int, T_target_source: np.ndarray) -> dict:
        return errors_of(pair_of(k), scale_translation(T_target_source, pair_of(k).scale))

    order = progress(range(len(pairs)), f"registration of scans of {name}, seed {seed}")
    return try_each(methods, settings.global_start, "scans", order, asked, errors)


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
    """Return unit normals (N, 3) that point to the sensor, or away from the middle where its position is unknown."""
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
