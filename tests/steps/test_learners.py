"""The step ``learners`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from .command_lines import arrays_changed, refused, removed, settings, untouched

FAULTS = [
    (removed("shifted.npz"), {}, r"shifted.npz: no such file; make it with 'python -m gpca shift'"),
    (arrays_changed("shifted.npz", h=lambda h: h * np.nan), {}, r"shifted.npz: array 'h' contains NaN"),
    (
        arrays_changed("shifted.npz", concept=lambda c: np.full_like(c, "pose")),
        {"--learners": ["learner_nearest", "gpca"]},
        r"fewer than two concepts",
    ),
    (untouched, settings("learners", gpca={"iteration": 5}), r"explainer 'gpca': .*iteration|setting iteration"),
    (untouched, {"--learners": ["gpca", "learner_oracle"]}, r"explainer 'learner_oracle': unknown"),
    (untouched, {"--learners": ["gpca", "residuals_forest"]}, r"'residuals_forest': does not read embeddings"),
    (untouched, {"--learners": ["gpca"]}, r"--out: 2 file\(s\) for 1 pair\(s\) of learner and seed; give one for each"),
    (untouched, {"--seeds": [0, 1]}, r"--sets: 1 file\(s\) for 2 seed\(s\)"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "learners", *FAULTS[fault])
