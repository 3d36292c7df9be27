"""Registrations of depth frames whose causes are measured, as docs/appendix.md says: nothing was simulated."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from gpca.causes.candidate import Candidate, Unmeasurable
from gpca.causes.dataset import Causes
from gpca.causes.measuring import Measuring, RecordedPair, Subject, found_in, measure_cases, measure_clean_pairs
from gpca.causes.settings import FEWEST_POINTS, CauseSettings, FrameCauseSettings
from gpca.frames.instances import KINDS, Instances, Starts
from gpca.frames.shots import CleanView, clean_view, rendered_side
from gpca.objects.camera import MeshScene
from gpca.objects.canonical import TRAINING, ObjectClouds
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.rigid import inverse, rotation_angle_rad, scale_translation
from gpca.seeds import generator

OUTLINE_POINTS = 2048  # of an object, which tell where in the image it lies


def chosen_starts(starts: Starts, instances: Instances, source: str, settings: FrameCauseSettings) -> Starts:
    """Return the starts that are measured, in order: of each kind a draw, of instances in scenes that may be tested."""
    is_tested_K = instances.fold[starts.instance] != TRAINING
    scene_K = instances.cluster[starts.instance]
    chosen: list[int] = []
    for kind in KINDS:
        rows = generator(source, "frame causes", kind).permutation(np.flatnonzero(is_tested_K & (starts.kind == kind)))
        turn = pd.Series(scene_K[rows]).groupby(scene_K[rows]).cumcount()  # of each within its scene
        chosen += np.sort(rows[np.argsort(turn, kind="stable")][: settings.starts]).tolist()
    return starts.subset(np.array(chosen, int))


def measure_frames(
    instances: Instances,
    starts: Starts,
    objects: ObjectClouds,
    meshes: Mapping[int, MeshScene],
    source: str,
    seed: int,
    settings: CauseSettings,
    points: int,
) -> tuple[Causes, pd.DataFrame]:
    """Measure the causes of registrations from these starts, of `points` points at most; return a row for each, too."""
    subjects, limit = measure_clean_pairs(subjects_of(instances, starts.instance, objects), source, seed, settings)
    subject_of = {subject.index: subject for subject in subjects}

    def case(k: int) -> RecordedPair:
        i, began = int(starts.instance[k]), f"{starts.kind[k]}, {starts.init_from[k]}"
        axes = (source, seed, "frame causes", i, began)

        def candidate() -> tuple[Candidate, Subject]:
            if (subject := subject_of.get(int(instances.object_index[i]))) is None:
                raise Unmeasurable("its clean pairs are misaligned")
            T_init, random = starts.T_camera_object_init[k], generator(*axes)
            return frame_candidate(instances, i, T_init, subject, meshes[subject.index], points, random), subject

        return RecordedPair(k, i, f"instance {i} ({began})", axes, candidate)

    nothing = ("no instance in the frames can be measured", "check the meshes and poses")
    cases = map(case, progress(range(len(starts)), f"causes of {source}, seed {seed}"))
    causes = measure_cases(cases, Measuring(settings, limit), (source, seed), nothing)
    sample_S, (severities, found) = causes.registrations.sample, found_in(causes)
    started = starts.subset(sample_S)
    seen = {"sample": sample_S, "instance": started.instance, "start": started.kind, "init_from": started.init_from}
    seen |= {name: getattr(instances, name)[started.instance] for name in ("dataset", "scene", "image")}
    return causes, pd.DataFrame({**seen, "object": causes.registrations.object_name, **severities, **found})


def frame_candidate(
    instances: Instances,
    i: int,
    T_init: np.ndarray,
    subject: Subject,
    mesh: MeshScene,
    points: int,
    random: np.random.Generator,
) -> Candidate:
    """Return an instance started at ``T_camera_object``, with all that may be taken away; may raise Unmeasurable."""
    diameter_m, sighting, outline_m = subject.diameter_m, instances.sighting(i), outline(subject)
    T_true = instances.T_camera_object_true[i]
    if (view := clean_view(sighting, T_true, mesh, outline_m)) is None:
        raise Unmeasurable("its pixels show none of the mesh at the true pose")
    sides_m = [rendered_side(mesh, sighting.camera_3_3, T, outline_m)[0] for T in (T_init, T_true)]
    # The same numbers draw the points of both, so that another draw alone is no effect of the pose.
    order = random.random(max(map(len, sides_m)))
    at_init_m, at_truth_m = (side_m[np.argsort(order[: len(side_m)])[:points]] for side_m in sides_m)
    if min(len(at_init_m), len(at_truth_m)) < FEWEST_POINTS:
        raise Unmeasurable("its mesh is not visible at the pose that ICP starts from")
    kept = random.permutation(len(view.clean))[:points]
    T_model_observed = scale_translation(inverse(T_init) @ T_true, 1 / diameter_m)
    models = at_init_m / diameter_m, at_truth_m / diameter_m
    return candidate_of_view(view, kept, *models, T_model_observed, diameter_m, random)


def outline(subject: Subject) -> np.ndarray:
    """Return points (Q, 3) of an object, meters, that tell where in an image it lies."""
    return subject.surface[:OUTLINE_POINTS] * subject.diameter_m


def candidate_of_view(
    view: CleanView,
    kept: np.ndarray,
    model: np.ndarray,
    model_at_truth: np.ndarray,
    T_model_observed: np.ndarray,
    diameter_m: float,
    random: np.random.Generator,
) -> Candidate:
    """Return what was seen of an object at a pose that is taken for the true one, with all that may be taken away."""
    most = round(len(kept) * (1 - view.share) / max(view.share, 1e-9))
    hidden = view.unmeasured[random.permutation(len(view.unmeasured))[:most]]
    residuals = view.measured[kept] - view.clean[kept]
    noisy = np.concatenate([view.measured[kept], hidden + residuals[random.integers(len(kept), size=len(hidden))]])
    return Candidate(
        applied=np.ones(len(CONCEPTS), bool),
        model=model,
        clean=np.concatenate([view.clean[kept], hidden]) / diameter_m,
        noisy=noisy / diameter_m,
        seen=np.arange(len(kept) + len(hidden)),
        kept=np.arange(len(kept)),
        T_near=np.eye(4),
        T_init=T_model_observed,
        severity={
            "noise": float(np.sqrt(np.square(residuals).sum(axis=1).mean() / 3)) / diameter_m,
            "outliers": 0.0,
            "rotation_rad": rotation_angle_rad(T_model_observed),
            "translation": float(np.linalg.norm(T_model_observed[:3, 3])),
            "crop": 1 - view.share,
        },
        model_at_truth=model_at_truth,
    )


def subjects_of(instances: Instances, rows: np.ndarray, objects: ObjectClouds) -> list[Subject]:
    """Return the objects that the instances show; symmetric is what the dataset says is."""
    return [
        Subject.of(objects, index, bool(instances.symmetric[instances.object_index == index].any()))
        for index in np.unique(instances.object_index[rows]).tolist()
    ]
