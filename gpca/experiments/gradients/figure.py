"""Draws saliency maps: the points of a cloud, colored by how much GP-CA's score reacts to them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.experiments.gradients.metrics import DELETION_COLUMNS
from gpca.io.arrays import REAL, WHOLE, load_arrays
from gpca.io.csv_file import numbers, read_csv
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import widest_views
from gpca.reporting.figures.panels import panels
from gpca.reporting.figures.style import LIGHT_GRAY, SMALL_PT, blues, write_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT_IN = 2.75
PALEST = -0.25  # White, which no point has, is so far below the least rank.


def draw_saliency(registrations_npz: str | Path, maps_npz: str | Path, deletions_csv: str | Path, title: str) -> Figure:
    """Draw one sample of each concept: of those named right, the one with the median score.

    Args:
        registrations_npz, maps_npz, deletions_csv: Of one source and seed.
    """
    registrations = Registrations.load(registrations_npz)
    shapes: dict[str, tuple[int | str, ...]] = {"sample": ("S",), "points": ("S", "N", 3), "saliency": ("S", "N")}
    kinds = {"sample": WHOLE, "points": REAL, "saliency": REAL}
    maps = load_arrays(maps_npz, shapes, kinds)
    rows = read_csv(deletions_csv, DELETION_COLUMNS).drop_duplicates("sample")
    rows["before"] = numbers(deletions_csv, rows, "before")
    chosen = {concept: _chosen(rows[rows["concept"] == concept]) for concept in CONCEPTS}
    test = {int(registrations.sample[row]): row for row in registrations.rows("test")}
    places = {int(sample): place for place, sample in enumerate(maps["sample"])}
    shown = {concept: sample for concept, sample in chosen.items() if sample is not None}
    if not shown or set(shown.values()) - (set(test) & set(places)):
        raise InputError(maps_npz, f"its samples differ from those of {deletions_csv}", "regenerate both")
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    figure, [axes] = panels(1, len(CONCEPTS), HEIGHT_IN)
    for panel, concept in zip(axes, CONCEPTS, strict=True):
        panel.set_axis_off()
        if concept in shown:
            sample = shown[concept]
            of_sample = (maps["points"][places[sample]], maps["saliency"][places[sample]])
            _draw_map(panel, registrations.target(test[sample]), *of_sample)
            score = rows.loc[rows["sample"] == str(sample), ["named", "before"]].iloc[0]
            panel.set_title(f"{concept}: named {score['named']}, {score['before']:.2f}", fontsize=SMALL_PT + 1)
    ranked = ScalarMappable(Normalize(PALEST, 1), blues())
    bar = figure.colorbar(ranked, ax=axes, shrink=0.75, pad=0.01, ticks=[0, 0.5, 1])
    bar.ax.set_ylim(0, 1)
    bar.set_label("rank of the point's saliency", fontsize=SMALL_PT)
    bar.ax.set_yticklabels(["least", "median", "most"], fontsize=SMALL_PT)
    write_title(figure, f"{title}: points that GP-CA's score reacts to")
    return figure


def _chosen(of_concept) -> int | None:
    right = of_concept[of_concept["named"] == of_concept["concept"]]
    kept = (of_concept if right.empty else right).sort_values(["before", "sample"], kind="stable")
    return None if kept.empty else int(kept["sample"].iloc[(len(kept) - 1) // 2])


def _draw_map(panel, target_Q_3: np.ndarray, points_N_3: np.ndarray, saliency_N: np.ndarray) -> None:
    """Scatter the target in gray and the points by the rank of their saliency, the salient ones in front."""
    view = widest_views(target_Q_3)[0]
    target, points = target_Q_3 @ view.T, points_N_3 @ view.T
    panel.scatter(target[:, 0], target[:, 1], s=0.6, c=LIGHT_GRAY, linewidths=0)
    order = np.argsort(saliency_N, kind="stable")
    ranks = np.linspace(0, 1, len(order))
    panel.scatter(points[order, 0], points[order, 1], s=5, c=ranks, cmap=blues(), vmin=PALEST, vmax=1, linewidths=0)
    panel.set_aspect("equal", adjustable="datalim")
