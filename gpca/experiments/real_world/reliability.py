"""Draws whether GP-CA's confidence on depth frames is to be believed, backbone by backbone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from gpca.attribution.diagnostics import BINS
from gpca.attribution.metrics import source_method_seed
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.experiments.diagnosis.reliability import draw_reliability_panel
from gpca.reporting.figures.panels import finish_panels, small_panels
from gpca.reporting.figures.style import SMALL_PT


def draw_frame_reliability(
    prediction_files: Iterable[str | Path],
    methods: Mapping[str, str],
    title: str,
    pdf_path: str | Path,
    png_path: str | Path,
) -> None:
    """Draw accuracy over confidence on the test samples of depth frames, all seeds together.

    Args:
        prediction_files: named ``…/{source}/{method}/seed{seed}.csv``, of one source.
        methods: the title of each method, in order; those without predictions are left out.
        title: of the frames.
        pdf_path: the figure.
        png_path: the same figure.

    Raises:
        InputError: no predictions of these methods, what the reader of predictions refuses.
    """
    parts: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for path in prediction_files:
        rows = read_predictions(path)
        rows = rows[(rows["split"] == "test") & ~rows["abstained"]]
        scores_N_C = rows[[f"score_{concept}" for concept in concepts_of(rows)]].to_numpy(float)
        hit_N = (rows["concept_predicted"] == rows["concept_true"]).to_numpy()
        parts.setdefault(source_method_seed(path)[1], []).append((scores_N_C.max(axis=1), hit_N))
    shown = [method for method in methods if method in parts]
    if not shown:
        raise InputError("predictions on depth frames", "cover none of these methods", "run them first")
    figure, panels = small_panels(len(shown), panel_height_in=1.55)
    for panel, method in zip(panels, shown, strict=True):
        confidence_N, hit_N = (np.concatenate(columns) for columns in zip(*parts[method], strict=True))
        gap = draw_reliability_panel(panel, confidence_N, hit_N, BINS)
        panel.set_title(f"{methods[method]}\npooled ECE {gap:.3f}", fontsize=SMALL_PT)
        panel.set_xlim(1 / 3 - 0.03, 1.02)
        panel.set_xticks([0.4, 0.6, 0.8, 1.0], ["0.4", "0.6", "0.8", "1"])
    handles, labels = panels[0].get_legend_handles_labels()
    finish_panels(figure, panels, title, handles, labels, "largest score", "accuracy", pdf_path, png_path)
