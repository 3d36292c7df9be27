"""The step ``shift`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import SHIFT, arrays_changed, refused, removed, settings, untouched

FAULTS = [
    (removed("weights.pt"), {}, r"weights.pt: no such weights"),
    (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"embeddings.npz: its samples differ from"),
    (untouched, settings("shift", shift=SHIFT | {"sample": 3}), r"setting sample: unknown; did you mean samples\?"),
    (untouched, settings("shift", shift=SHIFT | {"encoder": {"options": {}}}), r"setting encoder.options: unknown"),
    (untouched, settings("shift", shifts={}), r"setting shifts: unknown; choose one of shift, registrations, encoder"),
    (untouched, {"--other-registrations": ["registrations.npz"] * 2}, r"--other-registrations: 2 file\(s\) for 1"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "shift", *FAULTS[fault])
