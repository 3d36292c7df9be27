"""The step ``kernel_grid`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from .command_lines import arrays_changed, refused, removed, settings, untouched

FAULTS = [
    (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with 'python -m gpca embed'"),
    (arrays_changed("embeddings.npz", h=lambda h: h * np.nan), {}, r"embeddings.npz: array 'h' contains NaN"),
    (untouched, settings("kernel_grid", kernels=["cubic"]), r"setting kernels.0: 'cubic' is not one of"),
    (untouched, settings("kernel_grid", iterations=[0]), r"setting iterations.0: 0 should be greater than or equal to"),
    (untouched, {"--seeds": [0, 1]}, r"--registrations: 1 file\(s\) for 2 seed\(s\)"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "kernel_grid", *FAULTS[fault])
