"""Draws Fig. 5 of the paper: from a depth frame to an attribution, in four panels."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.errors import InputError
from gpca.experiments.method.concepts import source_before_icp
from gpca.experiments.real_world.frame_views import draw_scores, read_samples
from gpca.frames.instances import Instances
from gpca.frames.synthesis import HALF_SPACE, OCCLUDER
from gpca.io.files import read_image
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.reporting.figures.cloud_views import legend_of_clouds
from gpca.reporting.figures.panels import panels, write_below
from gpca.reporting.figures.style import BLACK, SOURCE_COLOR, TARGET_COLOR, YELLOW, write_title
from gpca.reporting.words import BOP_TITLES, object_of_frames

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

LOST_TO = {OCCLUDER: "an occluder", HALF_SPACE: "a half-space"}
HEIGHT_IN = 2.4
SMALLEST_PART = 0.02  # Smaller parts of an object's pixels lie at its rim, where no point was drawn.
AROUND = (2.5, 1.2)  # The first picture, and the two others, show this many times the object's extent.


def draw_real_world_example(
    instances_npz: str | Path,
    objects_npz: str | Path,
    registrations_npz: str | Path,
    poses_csv: str | Path,
    predictions_csv: str | Path,
    title: str,
    success: float,
) -> Figure:
    """Draw (a) a part of the frame with the object's region and what of it is covered, (b) its points at the initial
    pose over the model as the camera sees both, (c) after ICP, with the estimated axes, and (d) the concept scores.

    The figure shows a failure that missing overlap caused: a test sample that an occluder covers and that is attributed
    rightly, whose initial pose was right and whose pose after ICP is not, and of the half of such samples that are the
    largest in their images the one with the median score. Where there is none such, the wishes are dropped from the
    last on. A pose is right whose error is below `success`, in diameters.
    """
    instances = Instances.load(instances_npz)
    objects = ObjectClouds.load(objects_npz)
    registrations = Registrations.load(registrations_npz)
    samples = read_samples(poses_csv, predictions_csv)
    shown_px = np.where(instances.is_colored, np.diff(instances.offsets), 0)
    row = choose_sample(samples, predictions_csv, shown_px, success)
    sample = samples.iloc[row]
    i = int(sample["instance"])
    camera = _Camera(instances, i, registrations, row)
    from matplotlib.patches import Rectangle
    from matplotlib.patheffects import withStroke

    image = read_image(str(instances.colour[i]), "fetch the frames anew")
    figure, [drawn] = panels(1, 4, HEIGHT_IN, width_ratios=(3, 3, 3, 2.2))
    model_m = objects.points(int(instances.object_index[i]))[:3000]
    observed_m = registrations.diameter_m[row] * registrations.cloud(row)
    initial_m = registrations.diameter_m[row] * source_before_icp(registrations, row)
    poses = {pose: camera.T_camera_target(pose) for pose in ("init", "icp")}
    seen = {
        (pose, name): camera.project(transform(poses[pose], points_m))
        for pose, source_m in (("init", initial_m), ("icp", observed_m))
        for name, points_m in (("model", model_m), ("source", source_m))
    }
    own_px = instances.pixels_of(i)
    everything = np.concatenate([own_px, *seen.values()])
    for panel, times in zip(drawn, (AROUND[0], AROUND[1], AROUND[1]), strict=False):
        # Not interpolated, a photo makes the PNG a third as large.
        panel.imshow(image, alpha=1.0 if panel is drawn[0] else 0.55, interpolation="nearest")
        _zoom(panel, everything, times, image.shape)
    (left, top), (right, bottom) = everything.min(axis=0), everything.max(axis=0)
    region = Rectangle((left, top), right - left, bottom - top, fill=False, edgecolor=YELLOW, linewidth=1.2)
    drawn[0].add_patch(region)
    for panel in drawn[:3]:
        _shade(panel, covered(own_px, seen["init", "source"], image.shape[:2]))
    large = float(np.clip(2000 / len(observed_m), 1.1, 5))  # Few points are drawn larger.
    looks: dict[str, dict[str, Any]] = {
        "model": {"color": TARGET_COLOR, "s": 0.7},
        "source": {"color": SOURCE_COLOR, "s": large},
    }
    for panel, pose in ((drawn[1], "init"), (drawn[2], "icp")):
        for name, look in looks.items():
            panel.scatter(*seen[pose, name].T, linewidths=0, **look)
    ends_m = np.vstack([np.zeros(3), 0.3 * registrations.diameter_m[row] * np.eye(3)])
    origin, *tips = camera.project(transform(poses["icp"], ends_m))
    for tip, name in zip(tips, "xyz", strict=True):
        outline = [withStroke(linewidth=2.4, foreground="white")]
        arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": BLACK, "lw": 1.2, "mutation_scale": 7}
        drawn[2].annotate("", tip, origin, arrowprops=arrow | {"shrinkA": 0, "path_effects": outline})
        x, y = np.clip(tip + 0.15 * (tip - origin), *_inside(drawn[2]))
        letter: dict[str, Any] = {"path_effects": outline, "fontweight": "bold"}
        drawn[2].text(x, y, name, color=BLACK, ha="center", va="center", **letter)
    draw_scores(drawn[3], sample)
    failed = ", failed" if sample["icp_error"] >= success else ""
    captions = (
        "(a) Region of interest; black: covered",
        f"(b) Initial pose: {100 * sample['init_error']:.1f} % $d$ off",
        f"(c) After ICP: {100 * sample['icp_error']:.1f} % $d$ off{failed}",
    )
    for panel, caption in zip(drawn[:3], captions, strict=True):
        panel.set_axis_off()
        write_below(panel, caption)
    drawn[3].set_xlabel("(d) Scores, the truth bold", labelpad=1)
    lost = f"{100 * registrations.severity_crop[row]:.0f} % of the points lost to {LOST_TO[sample['lost_to']]}"
    name = str(registrations.object_name[row])
    write_title(figure, f"{title_of_frame(name, title)}: {object_of_frames(name)}, {lost}")
    legend_of_clouds(figure, "model", "measured", gap=0.1)
    return figure


def choose_sample(samples: pd.DataFrame, path: str | Path, pixels_I: np.ndarray, success: float) -> int:
    """Return the row that is shown; see :func:`draw_real_world_example`. Instance i shows ``pixels_I[i]`` colors."""
    is_seen = pixels_I[samples["instance"].to_numpy(int)] > 0
    overlap = samples[is_seen & (samples["split"] == "test") & (samples["concept_true"] == "overlap")]
    if overlap.empty:
        raise InputError(path, "has no test sample of overlap in a frame with colors", "raise real_world.test")
    wishes = (
        samples["lost_to"] == OCCLUDER,
        samples["concept_predicted"] == "overlap",
        samples["icp_error"] >= success,
        samples["init_error"] < success,
    )
    for wish in wishes:
        narrower = overlap[wish.reindex(overlap.index)]
        overlap = overlap if narrower.empty else narrower
    sized = overlap.assign(pixels=pixels_I[overlap["instance"].to_numpy(int)])
    ranked = sized.nlargest((len(sized) + 1) // 2, "pixels").sort_values(["score_overlap", "sample"])
    return int(ranked.index[len(ranked) // 2])


def title_of_frame(object_name: str, title: str) -> str:
    """Return the title of the shown frame, by the dataset before its object's name; else the title of all frames."""
    dataset = BOP_TITLES.get(object_name.partition(" ")[0], "")
    return f"{dataset} frame" if dataset and dataset in title else title


def covered(own_P_2: np.ndarray, kept_P_2: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the mask (H, W) of an object's pixels (u, v) that a sample has lost.

    A sample keeps a random draw of its points, so that pixels between kept ones count as kept.
    """
    from scipy.ndimage import binary_closing, label

    own, kept = np.zeros(shape, bool), np.zeros(shape, bool)
    for mask, pixels_P_2 in ((own, own_P_2), (kept, np.rint(kept_P_2).astype(int))):
        inside = (pixels_P_2 >= 0).all(axis=1) & (pixels_P_2 < shape[::-1]).all(axis=1)
        mask[tuple(pixels_P_2[inside, ::-1].T)] = True
    own = binary_closing(np.pad(own, 2), iterations=2)[2:-2, 2:-2]  # Single pixels were not measured.
    gap_px = int(np.ceil(1.5 * np.sqrt(own.sum() / max(kept.sum(), 1))))
    parts, _ = label(own & ~binary_closing(np.pad(kept, gap_px), iterations=gap_px)[gap_px:-gap_px, gap_px:-gap_px])
    sizes = np.bincount(parts.ravel(), minlength=1)
    sizes[0] = 0
    return (sizes >= SMALLEST_PART * own.sum())[parts]


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


def _shade(panel, mask: np.ndarray) -> None:
    """Darken a part of the image, and outline it."""
    if mask.any():
        panel.contourf(mask, [0.5, 1.5], colors=BLACK, alpha=0.5)
        panel.contour(mask, [0.5], colors=BLACK, linewidths=0.8)


def _zoom(panel, pixels_P_2: np.ndarray, times: float, shape: tuple[int, ...]) -> None:
    """Show the square part of the image around the pixels, `times` their extent."""
    size_2 = np.array(shape[1::-1])
    low_2, high_2 = pixels_P_2.min(axis=0), pixels_P_2.max(axis=0)
    half = min(times * np.max(high_2 - low_2), *size_2) / 2
    u, v = np.clip((low_2 + high_2) / 2, half, size_2 - half)
    panel.set(xlim=(u - half - 0.5, u + half - 0.5), ylim=(v + half - 0.5, v - half - 0.5))


def _inside(panel) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest pixel at which a letter stands whole within the panel."""
    ends = np.sort([panel.get_xlim(), panel.get_ylim()], axis=1)
    margin = 0.06 * np.ptp(ends, axis=1)
    return ends[:, 0] + margin, ends[:, 1] - margin
