"""The step ``runtime`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import refused, removed, untouched

FAULTS = [
    (removed("model.pt"), {}, r"model.pt: no such model; make one with 'make results'"),
    (untouched, {"--settings": {}}, r"leaves none of 18 training samples"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "runtime", *FAULTS[fault])
