"""The step ``uncertainty`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import refused, removed, settings, untouched

FAULTS = [
    (removed("registrations.npz"), {}, r"registrations.npz: no such file; make it with 'python -m gpca registr"),
    (untouched, settings("uncertainty", starts=12), r"setting starts: 12 should be greater than or equal to 13"),
    (untouched, settings("uncertainty", start=13), r"setting start: unknown; did you mean starts\?"),
    (untouched, settings("uncertainty", floor=0), r"setting floor: 0 is less than or equal to the minimum"),
    (untouched, settings("uncertainty", samples=4), r"setting samples: 4 is not a multiple of 3"),
    (untouched, settings("uncertainty", icp={"method": "gicp"}), r"setting method: 'gicp' is not one of"),
    (untouched, {"--seeds": [0, 1]}, r"--registrations: 1 file\(s\) for 2 seed\(s\); give one for each"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "uncertainty", *FAULTS[fault])
