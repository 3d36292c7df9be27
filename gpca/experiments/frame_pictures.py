"""Pictures of depth frames: a frame explained (Fig. 5), confusions, and the most confident mistakes."""

from pathlib import Path
from typing import Any

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.declarations import Figure, Frame, Run, figure
from gpca.errors import InputError
from gpca.experiments.confusions import draw_confusions
from gpca.experiments.frames import encoder_title, read_together, title_of_frames
from gpca.experiments.registration_stages import draw_scores, source_before_icp
from gpca.frames.instances import NO_COLOR, Instances
from gpca.frames.synthesis import HALF_SPACE, OCCLUDER
from gpca.io.container import require_same_samples
from gpca.io.csv_file import read_numbers
from gpca.io.files import read_image
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import FRAME_COLUMNS, Registrations
from gpca.reporting.figures.cloud_views import legend_of_clouds
from gpca.reporting.figures.panels import panels, write_below
from gpca.reporting.figures.style import BLACK, SOURCE_COLOR, TARGET_COLOR, YELLOW, write_title
from gpca.reporting.words import BOP_TITLES, object_of_frames
from gpca.rigid import inverse, transform

SECTION = "IV-E Real-world validation"
LOST_TO = {OCCLUDER: "a simulated occluder", HALF_SPACE: "a half-space"}
HEIGHT_IN = 2.4
SMALLEST_PART = 0.02  # Smaller parts of an object's pixels lie at its rim, where no point was drawn.
AROUND = (2.5, 1.2)  # The first picture, and the two others, show this many times the object's extent.
POSE_COLUMNS = ("sample", "split", "instance", "init_error", "icp_error", "lost_to")


@figure(
    SECTION,
    "Figure 5: from a depth frame to an attribution",
    """After Figure 5 of the paper: the object's region in a depth frame with what a simulated occluder covers of it in
    black, its points at the initial pose, after ICP, and GP-CA's scores beside the true cause. Errors are in % of the
    object's diameter d. The occluder is the silhouette of another object of the dataset, moved over this one.

    Shown is a failure: of the test samples that an occluder covers, that GP-CA names correctly, and that ICP moved
    from a right pose to a wrong one, the one with the median score among the larger half by size in the image.""",
    name="fig5_real_world_example",
    paper=True,
    instances_npz="instances/{frames}.npz",
    objects_npz="objects/{frames}.npz",
    registrations_npz="registrations/{frames}/seed{first_seed}.npz",
    poses_csv="poses/{frames}/seed{first_seed}.csv",
    predictions_csv="predictions/{frames}/{first_backbone}/seed{first_seed}.csv",
)
def draw_real_world_example(
    run: Run, instances_npz: Path, objects_npz: Path, registrations_npz: Path, poses_csv: Path, predictions_csv: Path
) -> Figure:
    """A pose is right whose error is below the config's `success.error`, in diameters."""
    from matplotlib.patches import Rectangle
    from matplotlib.patheffects import withStroke

    title, success = title_of_frames(run.config), run.config["success"]["error"]
    instances, objects = Instances.load(instances_npz), ObjectClouds.load(objects_npz)
    registrations = Registrations.load(registrations_npz)
    samples = read_samples(poses_csv, predictions_csv)
    shown_px = np.where(instances.colour != NO_COLOR, np.diff(instances.offsets), 0)
    row = choose_sample(samples, predictions_csv, shown_px, success)
    sample, diameter_m = samples.iloc[row], registrations.diameter_m[row]
    i = int(sample["instance"])
    # The source frame is the object's at the initial pose, so a source point's place in the camera is known.
    poses = {
        pose: instances.T_camera_object_init[i] @ inverse(getattr(registrations, f"T_target_source_{pose}")[row])
        for pose in ("init", "icp")
    }

    def project(pose: str, points_m: np.ndarray) -> np.ndarray:
        """Pixels (P, 2) of points in the target's frame, where the estimate says that it is."""
        seen = transform(poses[pose], points_m) @ instances.camera_3_3[i].T
        return seen[:, :2] / seen[:, 2:]

    image = read_image(str(instances.colour[i]), "fetch the frames anew")
    drawing, [drawn] = panels(1, 4, HEIGHT_IN, width_ratios=(3, 3, 3, 2.2))
    model_m = objects.points(int(instances.object_index[i]))[:3000]
    observed_m = diameter_m * registrations.cloud(row)
    seen = {(pose, "model"): project(pose, model_m) for pose in poses}
    seen["init", "source"] = project("init", diameter_m * source_before_icp(registrations, row))
    seen["icp", "source"] = project("icp", observed_m)
    own_px = instances.pixels_of(i)
    everything = np.concatenate([own_px, *seen.values()])
    low_2, high_2 = everything.min(axis=0), everything.max(axis=0)
    size_2 = np.array(image.shape[1::-1])
    lost = covered(own_px, seen["init", "source"], image.shape[:2])
    drawn[0].add_patch(Rectangle(low_2, *(high_2 - low_2), fill=False, edgecolor=YELLOW, linewidth=1.2))
    for panel, times in zip(drawn, (AROUND[0], AROUND[1], AROUND[1]), strict=False):
        # Not interpolated, a photo makes the PNG a third as large.
        panel.imshow(image, alpha=1.0 if panel is drawn[0] else 0.55, interpolation="nearest")
        half = min(times * np.max(high_2 - low_2), *size_2) / 2
        u, v = np.clip((low_2 + high_2) / 2, half, size_2 - half)
        panel.set(xlim=(u - half - 0.5, u + half - 0.5), ylim=(v + half - 0.5, v - half - 0.5))
        panel.set_axis_off()
        if lost.any():
            panel.contourf(lost, [0.5, 1.5], colors=BLACK, alpha=0.5)
            panel.contour(lost, [0.5], colors=BLACK, linewidths=0.8)
    large = float(np.clip(2000 / len(observed_m), 1.1, 5))  # Few points are drawn larger.
    for panel, pose in zip(drawn[1:3], poses, strict=True):
        panel.scatter(*seen[pose, "model"].T, linewidths=0, color=TARGET_COLOR, s=0.7)
        panel.scatter(*seen[pose, "source"].T, linewidths=0, color=SOURCE_COLOR, s=large)
    origin, *tips = project("icp", np.vstack([np.zeros(3), 0.3 * diameter_m * np.eye(3)]))
    ends_2_2 = np.sort([drawn[2].get_xlim(), drawn[2].get_ylim()], axis=1)
    margin_2 = 0.06 * np.ptp(ends_2_2, axis=1)  # A letter stands whole within the panel.
    look: dict[str, Any] = {"color": BLACK, "path_effects": [withStroke(linewidth=2.4, foreground="white")]}
    arrow = look | {"arrowstyle": "-|>", "lw": 1.2, "mutation_scale": 7, "shrinkA": 0}
    for tip, name in zip(tips, "xyz", strict=True):
        drawn[2].annotate("", tip, origin, arrowprops=arrow)
        place = np.clip(tip + 0.15 * (tip - origin), ends_2_2[:, 0] + margin_2, ends_2_2[:, 1] - margin_2)
        drawn[2].text(*place, name, ha="center", va="center", fontweight="bold", **look)
    draw_scores(drawn[3], sample)
    failed = ", failed" if sample["icp_error"] >= success else ""
    write_below(drawn[0], "(a) Region of interest; black: covered")
    write_below(drawn[1], f"(b) Initial pose: {100 * sample['init_error']:.1f} % $d$ off")
    write_below(drawn[2], f"(c) After ICP: {100 * sample['icp_error']:.1f} % $d$ off{failed}")
    drawn[3].set_xlabel("(d) Scores, the truth bold", labelpad=1)
    share = f"{100 * registrations.severity_crop[row]:.0f} % of the points lost to {LOST_TO[sample['lost_to']]}"
    name = str(registrations.object_name[row])
    dataset = BOP_TITLES.get(name.partition(" ")[0], "")  # stands before the name of an object
    title = f"{dataset} frame" if dataset and dataset in title else title
    write_title(drawing, f"{title}: {object_of_frames(name)}, {share}")
    legend_of_clouds(drawing, "model", "measured", gap=0.1)
    return drawing


def read_samples(poses_csv: str | Path, predictions_csv: str | Path) -> Frame:
    """Poses and predictions of all samples side by side, in the order of the registrations."""
    poses = read_numbers(poses_csv, POSE_COLUMNS, ("instance", "init_error", "icp_error"), others=FRAME_COLUMNS)
    predictions = read_predictions(predictions_csv)
    require_same_samples(poses_csv, poses, predictions, "predictions")
    return poses.join(predictions[predictions.columns.difference(poses.columns, sort=False)])


def choose_sample(samples: Frame, path: str | Path, pixels_I: np.ndarray, success: float) -> int:
    """Row of the test sample of overlap that is shown; instance i shows ``pixels_I[i]`` colored pixels.

    It is one that an occluder covers, that is attributed rightly, and that ICP moved to a wrong pose from a right one;
    where there is none such, the wishes are dropped from the last on. Of the larger half, it has the median score.
    """
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


@figure(
    SECTION,
    "Confusions on depth frames",
    """What GP-CA takes each concept for on depth frames. The paper reports that pose and overlap are confused most
    (Sec. IV-E).""",
    name="confusion_real_world",
    metrics=(read_together, "real_world.csv"),
)
def draw_real_world_confusions(run: Run, metrics: Frame) -> Figure:
    """A matrix for each backbone with the first reduction: shares of each true concept in %, and counts."""
    frames = run.config["real_world"]
    first = next(iter(frames["reductions"]))
    titles = {f"{backbone}-{first}": encoder_title(backbone, first) for backbone in frames["backbones"]}
    return draw_confusions(metrics, titles, (), title_of_frames(run.config), "{:.1f} %\nn = {:.0f}")
