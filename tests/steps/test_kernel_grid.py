"""The step ``kernel_grid`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from .command_lines import arrays_changed, refused, removed

FAULTS = [
    (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with Snakemake"),
    (arrays_changed("embeddings.npz", h=lambda h: h * np.nan), {}, r"embeddings.npz: array 'h' contains NaN"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "kernel_grid", *FAULTS[fault])
