"""Draws the ten most confident mistakes on depth frames: cloud over model, and GP-CA's scores."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments.real_world.frame_views import draw_over_model, draw_scores, read_samples
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.reporting.figures.style import SMALL_PT, TEXT_WIDTH_IN, use_style, write_title
from gpca.reporting.words import object_of_frames

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 10
PANELS_PER_ROW = 5


def draw_real_world_failures(
    objects_npz: str | Path,
    registrations_npz: Sequence[str | Path],
    poses_csv: Sequence[str | Path],
    predictions_csv: Sequence[str | Path],
    title: str,
) -> Figure:
    """Draw the test samples of all seeds that were attributed wrongly with the highest score, one of each instance.

    The three lists of files run through the seeds in the same order.
    """
    objects = ObjectClouds.load(objects_npz)
    mistakes = _mistakes(poses_csv, predictions_csv)
    shown = list(mistakes.head(SHOWN).iterrows())
    rows = max(1, -(-len(shown) // PANELS_PER_ROW))
    figure = use_style().figure(figsize=(TEXT_WIDTH_IN, 0.22 + 2.1 * rows), layout="constrained")
    parts = figure.subfigures(rows, PANELS_PER_ROW, squeeze=False).flat
    loaded = {file: Registrations.load(registrations_npz[file]) for file in sorted({m["file"] for _, m in shown})}
    for part, (_, mistake) in zip(parts, shown, strict=False):
        registrations = loaded[mistake["file"]]
        row = int(mistake["row"])
        above, below = part.subplots(2, 1, height_ratios=(2.5, 1))
        index = int(registrations.object_index[row])
        model = objects.points(index)[:2048] / objects.diameters_m[index]
        draw_over_model(above, model, registrations.cloud(row))
        draw_scores(below, mistake)
        name = object_of_frames(registrations.object_name[row])
        taken = f"{mistake['concept_true']} taken for {mistake['concept_predicted']}"
        words = f"{name}\n{taken}\npose {100 * mistake['icp_error']:.0f} % $d$ off"
        part.suptitle(words, fontsize=SMALL_PT, linespacing=1.15)
    none = "" if shown else ": no mistake in any seed"
    write_title(figure, f"{title}{none}")
    return figure


def _mistakes(poses_csv: Sequence[str | Path], predictions_csv: Sequence[str | Path]) -> pd.DataFrame:
    """Return wrongly attributed test samples, the most confident first, one of each instance and concept."""
    parts = []
    for file, (poses, predictions) in enumerate(zip(poses_csv, predictions_csv, strict=True)):
        samples = read_samples(poses, predictions).rename_axis("row").reset_index()
        wrong = (samples["split"] == "test") & (samples["concept_predicted"] != samples["concept_true"])
        scores = samples[[name for name in samples.columns if name.startswith("score_")]].max(axis=1)
        parts.append(samples.assign(file=file, score=scores, seed=source_method_seed(predictions)[2])[wrong])
    if not parts:
        raise InputError("real_world_failures", "has no files", "name at least one seed")
    mistakes = pd.concat(parts).sort_values(["score", "seed", "row"], ascending=[False, True, True])
    return mistakes.drop_duplicates(["instance", "concept_true"]).reset_index(drop=True)
