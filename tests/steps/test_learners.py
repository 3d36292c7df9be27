"""The step ``learners`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from .command_lines import arrays_changed, refused, removed, untouched

FAULTS = [
    (removed("shifted.npz"), {}, r"shifted.npz: no such file; make it with Snakemake"),
    (arrays_changed("shifted.npz", h=lambda h: h * np.nan), {}, r"shifted.npz: array 'h' contains NaN"),
    (
        arrays_changed("shifted.npz", concept=lambda c: np.full_like(c, "pose")),
        {"--learners": ["learner_nearest", "gpca"]},
        r"fewer than two concepts",
    ),
    (untouched, {"--learners": ["gpca", "learner_oracle"]}, r"explainer 'learner_oracle': unknown"),
    (untouched, {"--learners": ["gpca", "residuals_forest"]}, r"'residuals_forest': does not read embeddings"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "learners", *FAULTS[fault])
