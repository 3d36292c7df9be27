"""Draws Fig. 5 of the paper: from a depth frame to an attribution, in four panels."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.errors import InputError
from gpca.files import read_image
from gpca.frames.instances import Instances
from gpca.frames.synthesis import HALF_SPACE, OCCLUDER
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.reporting.figures.cloud_views import legend_of_clouds
from gpca.reporting.figures.concepts import source_before_icp
from gpca.reporting.figures.frame_views import draw_scores, read_samples
from gpca.reporting.figures.style import (
    GREEN,
    SKY_BLUE,
    SOURCE_COLOUR,
    TARGET_COLOUR,
    TEXT_WIDTH_IN,
    VERMILION,
    YELLOW,
    save_figure,
    use_style,
    write_title,
)
from gpca.reporting.words import object_of_frames

if TYPE_CHECKING:
    import pandas as pd

LOST_TO = {OCCLUDER: "an occluder", HALF_SPACE: "a half-space"}
AXIS_COLOURS = (VERMILION, GREEN, SKY_BLUE)  # Robotics draws x, y and z in red, green and blue.


def draw_real_world_example(
    instances_npz: str | Path,
    objects_npz: str | Path,
    registrations_npz: str | Path,
    poses_csv: str | Path,
    predictions_csv: str | Path,
    title: str,
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Draw (a) the frame with the object's region, (b) its points at the initial pose over the model as the camera
    sees both, (c) after ICP, with the estimated axes, and (d) the concept scores with their deviations.

    The figure shows a test sample that an occluder covers (else any overlap sample) and that is attributed rightly:
    the one with the median score of such samples.

    Raises:
        InputError: an unusable file, or no test sample of the concept overlap.
    """
    instances = Instances.load(instances_npz)
    objects = ObjectClouds.load(objects_npz)
    registrations = Registrations.load(registrations_npz)
    samples = read_samples(poses_csv, predictions_csv)
    row = choose_sample(samples, predictions_csv)
    sample = samples.iloc[row]
    i = int(sample["instance"])
    camera = _Camera(instances, i, registrations, row)
    use_style()
    import matplotlib.pyplot as plt
    from matplotlib.patheffects import withStroke

    image = read_image(str(instances.colour[i]), "fetch the frames anew")
    height_in = 1.72
    figure = plt.figure(figsize=(TEXT_WIDTH_IN, height_in))
    panels = [figure.add_axes((left, 0.13, 0.235, 0.74)) for left in (0.005, 0.25, 0.495)]
    panels.append(figure.add_axes((0.815, 0.33, 0.165, 0.5)))
    u, v = instances.pixels_of(i).T
    panels[0].imshow(image)
    box = plt.Rectangle((u.min(), v.min()), np.ptp(u), np.ptp(v), fill=False, edgecolor=YELLOW, linewidth=1.2)
    panels[0].add_patch(box)
    model_m = objects.points(int(instances.object_index[i]))[:3000]
    observed_m = registrations.diameter_m[row] * registrations.cloud(row)
    initial_m = registrations.diameter_m[row] * source_before_icp(registrations, row)
    for panel, source_m, pose in ((panels[1], initial_m, "init"), (panels[2], observed_m, "icp")):
        panel.imshow(image, alpha=0.55)
        T_camera_target = camera.T_camera_target(pose)
        for points_m, colour, size in ((model_m, TARGET_COLOUR, 0.5), (source_m, SOURCE_COLOUR, 0.8)):
            x, y = camera.project(transform(T_camera_target, points_m)).T
            panel.scatter(x, y, s=size, color=colour, linewidths=0)
        _zoom(panel, u, v, image.shape)
    ends_m = np.vstack([np.zeros(3), 0.5 * registrations.diameter_m[row] * np.eye(3)])
    origin, *tips = camera.project(transform(camera.T_camera_target("icp"), ends_m))
    for tip, colour, name in zip(tips, AXIS_COLOURS, "xyz", strict=True):
        panels[2].annotate(
            "", tip, origin, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.4, "mutation_scale": 7}
        )
        x, y = np.clip(tip + 0.15 * (tip - origin), *_inside(panels[2]))
        outlined: dict[str, Any] = {
            "path_effects": [withStroke(linewidth=1.5, foreground="white")],
            "fontweight": "bold",
        }
        panels[2].text(x, y, name, color=colour, ha="center", va="center", **outlined)
    draw_scores(panels[3], sample)
    panels[3].set_xlabel("score ± deviation", labelpad=1)
    captions = (
        "(a) Input and region of interest",
        f"(b) Initial pose: {100 * sample['init_error']:.1f} % $d$ off",
        f"(c) After ICP: {100 * sample['icp_error']:.1f} % $d$ off",
        "(d) GP-CA; true concept in bold",
    )
    for panel, centre, caption in zip(panels, (0.1225, 0.3675, 0.6125, 0.885), captions, strict=True):
        figure.text(centre, 0.02, caption, ha="center", va="bottom")
        if panel is not panels[3]:
            panel.set_axis_off()
    lost = f"{100 * registrations.severity_crop[row]:.0f} % of the points lost to {LOST_TO[sample['lost_to']]}"
    write_title(figure, f"{title}: {object_of_frames(registrations.object_name[row])}, {lost}")
    legend_of_clouds(figure, "model", "measured", gap=0.1)
    save_figure(figure, pdf_path, png_path)


def choose_sample(samples: pd.DataFrame, path: str | Path) -> int:
    """Return the row that is shown; see :func:`draw_real_world_example`."""
    overlap = samples[(samples["split"] == "test") & (samples["concept_true"] == "overlap")]
    if overlap.empty:
        raise InputError(path, "holds no test sample of overlap", "raise real_world.test")
    for column, wanted in (("lost_to", OCCLUDER), ("concept_predicted", "overlap")):
        narrower = overlap[overlap[column] == wanted]
        overlap = overlap if narrower.empty else narrower
    ranked = overlap.sort_values(["score_overlap", "sample"])
    return int(ranked.index[len(ranked) // 2])


class _Camera:
    """Knows the camera of an instance, and where a sample's target frame is in it under each estimate."""

    def __init__(self, instances: Instances, i: int, registrations: Registrations, row: int) -> None:
        self._camera_3_3 = instances.camera_3_3[i]
        self._T_camera_init = instances.T_camera_object_init[i]
        self._registrations = registrations
        self._row = row

    def T_camera_target(self, which: str) -> np.ndarray:
        """Return the pose of the target's frame that the estimate ``init`` or ``icp`` claims.

        The source frame is the object's at the initial pose, so a source point's place in the camera is known.
        """
        T_target_source = getattr(self._registrations, f"T_target_source_{which}")[self._row]
        return self._T_camera_init @ inverse(T_target_source)

    def project(self, points_m: np.ndarray) -> np.ndarray:
        """Return the pixels (P, 2) of points in the camera's frame."""
        seen = points_m @ self._camera_3_3.T
        return seen[:, :2] / seen[:, 2:]


def _zoom(panel, u: np.ndarray, v: np.ndarray, shape: tuple[int, ...]) -> None:
    """Show a part of the image, of its own shape, around the object."""
    height, width = shape[:2]
    half_v = min(0.85 * max(np.ptp(v), np.ptp(u) * height / width), height / 2)
    half_u = half_v * width / height
    centre_u = np.clip((u.min() + u.max()) / 2, half_u, width - half_u)
    centre_v = np.clip((v.min() + v.max()) / 2, half_v, height - half_v)
    panel.set(xlim=(centre_u - half_u, centre_u + half_u), ylim=(centre_v + half_v, centre_v - half_v))


def _inside(panel) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest pixel at which a letter stands whole within the panel."""
    ends = np.sort([panel.get_xlim(), panel.get_ylim()], axis=1)
    margin = 0.06 * np.ptp(ends, axis=1)
    return ends[:, 0] + margin, ends[:, 1] - margin
