"""Draws Fig. 3 of the paper: one object, perturbed in each of the three ways, over its clean target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import SEVERITIES_OF
from gpca.reporting.figures.cloud_views import draw_clouds, legend_of_clouds, widest_views
from gpca.reporting.figures.panels import panels, write_below
from gpca.reporting.figures.style import TEXT_WIDTH_IN, write_title
from gpca.reporting.words import object_in_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TITLES = {"noise": "Noise", "pose": "Pose error", "overlap": "Overlap"}


def draw_concepts_figure(
    objects_npz: str | Path,
    registrations_npz: str | Path,
    title: str,
    object_name: str | None = None,
    dataset: str = "",
) -> Figure:
    """Draw target (vermilion) and perturbed source in its initial pose (blue) in one panel per concept.

    The figure shows test samples of one object: `object_name`, or the object whose samples come nearest to the medium
    severity. One view serves all panels, and shows the pose error and the cut from the side. The object's name in words
    follows from its `dataset` of the BOP benchmark.
    """
    objects = ObjectClouds.load(objects_npz)
    registrations = Registrations.load(registrations_npz)
    samples = choose_samples(registrations, registrations_npz, object_name)
    name = str(registrations.object_name[samples["noise"]])
    if name not in objects.names:
        raise InputError(
            objects_npz, f"has no object '{name}'", f"regenerate it and {registrations_npz} from the same config"
        )
    sources = {concept: source_before_icp(registrations, sample) for concept, sample in samples.items()}
    row = objects.names.index(name)
    points_shown = max(len(source) for source in sources.values())  # This makes both clouds equally dense.
    target = objects.points(row)[:points_shown] / objects.diameters_m[row]
    view = choose_view(target, sources)

    clouds = {concept: (target @ view.T, source @ view.T) for concept, source in sources.items()}
    corners = np.concatenate([np.concatenate(pair) for pair in clouds.values()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    height_in = TEXT_WIDTH_IN / len(clouds) * (high[1] - low[1]) / (high[0] - low[0]) + 0.45  # title and captions
    figure, [drawn] = panels(1, len(clouds), height_in)
    for letter, panel, (concept, (target_view, source_view)) in zip("abc", drawn, clouds.items(), strict=True):
        draw_clouds(panel, target_view, source_view, corners=(low, high))
        severity = severity_text(registrations, samples[concept], concept)
        write_below(panel, f"({letter}) {TITLES[concept]}: {severity}")
    legend_of_clouds(figure, "target", "perturbed source, before ICP", gap=0.2)
    write_title(figure, f"{title}: {object_in_words(name, dataset)}")
    return figure


def choose_samples(registrations: Registrations, path: str | Path, object_name: str | None = None) -> dict[str, int]:
    """Return for each concept the row of one object's test sample that is nearest to the concept's medium severity.

    It compares severities by their rank within the test samples of the concept, so that no unit or range matters.
    The object is `object_name`, or the one whose farthest sample is nearest. Raises an InputError where there is none.
    """
    from scipy.stats import rankdata

    # The distance of a sample's rank from the middle rank is infinite where the sample cannot be shown.
    distance_S = np.full(len(registrations), np.inf)
    for concept, names in SEVERITIES_OF.items():
        rows = np.flatnonzero((registrations.split == "test") & (registrations.concept == concept))
        ranks = [rankdata(getattr(registrations, f"severity_{name}")[rows]) / (len(rows) + 1) for name in names]
        distance_S[rows] = np.abs(np.array(ranks) - 0.5).max(axis=0)
    is_shown_S = np.isfinite(distance_S)
    object_names = [object_name] if object_name else list(dict.fromkeys(registrations.object_name.tolist()))
    choices = []
    for name in object_names:
        of_object_S = is_shown_S & (registrations.object_name == name)
        rows_of = {c: np.flatnonzero(of_object_S & (registrations.concept == c)) for c in SEVERITIES_OF}
        if all(len(rows) for rows in rows_of.values()):
            choices.append({concept: int(rows[np.argmin(distance_S[rows])]) for concept, rows in rows_of.items()})
    if not choices:
        subject = f"object '{object_name}'" if object_name else "any object"
        raise InputError(path, f"has no test sample of each concept for {subject}", "name another or generate more")
    return min(choices, key=lambda samples: max(distance_S[sample] for sample in samples.values()))


def source_before_icp(registrations: Registrations, sample: int) -> np.ndarray:
    """Return the (P, 3) points of a sample in its initial pose, in the target's frame, relative to the diameter."""
    T_init_icp = registrations.T_target_source_init[sample] @ inverse(registrations.T_target_source_icp[sample])
    return transform(scale_translation(T_init_icp, 1 / registrations.diameter_m[sample]), registrations.cloud(sample))


def choose_view(target: np.ndarray, sources: dict[str, np.ndarray]) -> np.ndarray:
    """Return the rotation (3, 3) to a view's right, up and towards-the-viewer axes, with z up in the world.

    It keeps the 8 of 24 directions around the object that show it widest (a mug with its handle at the side), and
    picks the one of them that shows best how pose error and cut shift the centroid: the product of the visible shares
    is largest there.
    """
    shifts = [sources[concept].mean(axis=0) - target.mean(axis=0) for concept in ("pose", "overlap")]
    return max(widest_views(target), key=lambda view: np.prod([np.linalg.norm(view[:2] @ shift) for shift in shifts]))


def severity_text(registrations: Registrations, sample: int, concept: str) -> str:
    """Return a sample's severity as it is printed under its panel, with lengths relative to the diameter d."""
    if concept == "noise":
        return f"$\\sigma$ = {100 * registrations.severity_noise[sample]:.1f} % $d$"
    if concept == "pose":
        angle_deg = np.degrees(registrations.severity_rotation_rad[sample])
        return f"{angle_deg:.0f}° and {100 * registrations.severity_translation[sample]:.0f} % $d$"
    return f"{100 * registrations.severity_crop[sample]:.0f} % cut off"
