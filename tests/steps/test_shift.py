"""The step ``shift`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import arrays_changed, refused, removed

FAULTS = [
    (removed("weights.pt"), {}, r"weights.pt: no such weights"),
    (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"embeddings.npz: its samples differ from"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "shift", *FAULTS[fault])
