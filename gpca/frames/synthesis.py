"""Registrations of instances: partial clouds of depth frames, perturbed, aligned to their models, labeled."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gpca.alignment.pose_error import JUDGED_POINTS, pose_error
from gpca.frames.instances import Instances
from gpca.io.files import SPLITS
from gpca.io.frame import Frame
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Perturbed
from gpca.pairs.synthesis import RegistrationSettings, align_pair, as_registrations
from gpca.process.environment import require_open3d
from gpca.process.progress import progress
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator
from gpca.settings import OpenShare, Share

OCCLUDER, HALF_SPACE = "occluder", "half_space"
STEP_PX, TOLERANCE = 2, 0.03


@dataclass(frozen=True)
class FrameSettings:
    """How instances become registrations."""

    test_share: OpenShare = 0.4  # of the instances, in scenes that training does not see
    occluders: Share = 0.5  # share of overlap samples that lose points to an occluder; others to a half-space
    registration: RegistrationSettings = field(default_factory=RegistrationSettings)


def make_frame_registrations(
    instances: Instances, objects: ObjectClouds, source: str, seed: int, settings: FrameSettings
) -> tuple[Registrations, np.ndarray, Frame]:
    """Return aligned pairs of instances, perturbed about their initial poses, the seconds (S,) of ICP, a row for each.

    Samples 3t, 3t + 1 and 3t + 2 of a split show one instance under the three concepts; instances take turns.
    """
    import pandas as pd

    require_open3d()
    rows_of, cluster_I = instances.split(source, seed, settings.test_share), instances.cluster
    samples = [(split, n) for split in SPLITS for n in range(getattr(settings.registration, split))]
    trained = set(instances.object_index[rows_of["train"]].tolist())
    records, poses = [], []
    for split, n in progress(samples, f"registrations of {source}, seed {seed}"):
        deal, place = divmod(n, len(CONCEPTS))
        turns, row = divmod(deal, len(rows_of[split]))
        i = int(generator(source, seed, "instances", split, turns).permutation(rows_of[split])[row])
        concept = str(generator(source, seed, "concepts", split, deal).permutation(CONCEPTS)[place])
        random = generator(source, seed, "registration", split, n)
        record, lost_to = _register_one(instances, i, objects, concept, settings, random)
        sample = {"sample": n, "split": split, "concept": concept}
        records.append(record | sample | {"cluster": str(cluster_I[i]), "fold": int(instances.fold[i])})
        pose_row: dict[str, Any] = {**sample, "instance": i}
        pose_row |= {name: getattr(instances, name)[i] for name in ("dataset", "scene", "image")}
        pose_row |= {"object": record["object_name"], "in_training": record["object_index"] in trained}
        pose_row |= {"symmetric": bool(instances.symmetric[i]), "init_from": instances.init_from[i]}
        model_m = objects.points(record["object_index"])[:JUDGED_POINTS]
        T_source_target = inverse(record["T_target_source_true"])
        for name in ("init", "icp"):
            T_error = record[f"T_target_source_{name}"] @ T_source_target
            error_m = pose_error(model_m, T_error, np.eye(4), pose_row["symmetric"])
            pose_row[f"{name}_error"] = error_m / record["diameter_m"]
        poses.append(pose_row | {"lost_to": lost_to})
    return *as_registrations(records, (source, seed)), pd.DataFrame(poses)


def _register_one(
    instances: Instances, i: int, objects: ObjectClouds, concept: str, settings: FrameSettings, random
) -> tuple[dict, str]:
    index, registration = int(instances.object_index[i]), settings.registration
    diameter_m = float(objects.diameters_m[index])
    rows = random.permutation(len(instances.cloud_m(i)))[: registration.cloud_points]
    target_rows = random.permutation(len(objects.points(index)))[: registration.cloud_points]
    T_init_camera = inverse(instances.T_camera_object_init[i])
    points = transform(T_init_camera, instances.cloud_m(i)[rows].astype(np.float64)) / diameter_m
    kept_P, lost_to = None, HALF_SPACE if concept == "overlap" else ""
    if concept == "overlap" and random.random() < settings.occluders:
        share = random.uniform(*registration.severities.crop)
        kept_P = occlude(instances, i, instances.pixels_of(i)[rows], share, random)
    if kept_P is None:
        perturbed = PERTURBATIONS[concept](points, registration.severities, random)
    else:
        perturbed, lost_to = Perturbed(points[kept_P], severity={"crop": float(1 - kept_P.mean())}), OCCLUDER
    T_object_init = inverse(instances.T_camera_object_true[i]) @ instances.T_camera_object_init[i]
    T_true = scale_translation(T_object_init, 1 / diameter_m) @ perturbed.T_target_source_true
    perturbed = replace(perturbed, T_target_source_true=T_true)
    return align_pair(perturbed, objects, index, target_rows, registration.icp), lost_to


def occlude(
    instances: Instances, i: int, pixels_P_2: np.ndarray, share: float, random: np.random.Generator
) -> np.ndarray | None:
    """Return which pixels (P,) stay visible when an occluder covers about this share of them; None where none does."""
    from scipy.ndimage import binary_closing

    same_dataset_I = instances.dataset == instances.dataset[i]
    others = np.flatnonzero(same_dataset_I & (instances.object_index != instances.object_index[i]))
    center = pixels_P_2.mean(axis=0)
    for other in random.permutation(others):
        pixels = instances.pixels_of(other)
        corner = pixels.min(axis=0)
        u, v = (pixels - corner).T
        mask = np.zeros((v.max() + 1, u.max() + 1), bool)
        mask[v, u] = True
        # Closed where single pixels were not measured.
        silhouette = binary_closing(np.pad(mask, 3), iterations=2)[3:-3, 3:-3]
        angle, size_2 = random.uniform(0, 2 * np.pi), np.array(silhouette.shape[::-1])
        direction = np.array([np.cos(angle), np.sin(angle)])
        reach = np.linalg.norm(np.ptp(pixels_P_2, axis=0)) + np.linalg.norm(silhouette.shape)
        start = center - corner - size_2 / 2
        for distance_px in np.arange(reach, 0, -STEP_PX):
            at_P_2 = pixels_P_2 - np.rint(corner + start + distance_px * direction).astype(int)
            u, v = at_P_2.clip(0, size_2 - 1).T
            covered_P = ((at_P_2 >= 0) & (at_P_2 < size_2)).all(axis=1) & silhouette[v, u]
            if covered_P.mean() >= share:
                break
        if abs(covered_P.mean() - share) <= TOLERANCE:
            return ~covered_P
    return None
