"""Draws whether GP-CA's confidence on depth frames can be believed, backbone by backbone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.diagnostics import BINS
from gpca.attribution.metrics import source_method_seed
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.experiments.diagnosis.reliability import reliability_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_frame_reliability(prediction_files: Iterable[str | Path], methods: Mapping[str, str], title: str) -> Figure:
    """Draw accuracy over confidence on the test samples of depth frames, all seeds together.

    Args:
        prediction_files: named ``…/{source}/{method}/seed{seed}.csv``, of one source.
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
    samples = {}
    for method in shown:
        confidence_N, hit_N = (np.concatenate(columns) for columns in zip(*parts[method], strict=True))
        samples[methods[method]] = confidence_N, hit_N
    return reliability_figure(samples, title, BINS, least=1 / 3)
