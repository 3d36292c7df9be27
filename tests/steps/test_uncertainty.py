"""The step ``uncertainty`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import refused, removed

FAULTS = [
    (removed("registrations.npz"), {}, r"registrations.npz: no such file; make it with Snakemake"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "uncertainty", *FAULTS[fault])
