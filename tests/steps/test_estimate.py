"""The step ``estimate`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import STEP_OPTIONS, arrays_changed, refused, removed, settings, truncated, untouched

PAIRS = STEP_OPTIONS["estimate"]["--settings"]["estimator_pairs"]


def pairs(**changed):
    return settings("estimate", estimator_pairs=PAIRS | changed)


FAULTS = [
    (removed("causes.npz"), {}, r"causes.npz: no such file; make it with Snakemake"),
    (truncated("objects.npz"), {}, r"objects.npz: is not a readable npz archive"),
    (arrays_changed("objects.npz", names=lambda names: names[::-1]), {}, r"objects of tiny: object \d is not '\w+'"),
    (untouched, pairs(methods={"fgr": 3}), r"registration method 'fgr': is global, so its results have no spread"),
    (untouched, {"--samples": ["causes.npz"]}, r"causes.npz"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "estimate", *FAULTS[fault])


def test_seconds_are_in_a_file_of_their_own(made):
    rows, seconds = ((made / name).read_text().splitlines() for name in ("brossard_said.csv", "brossard_seconds.csv"))
    assert "seconds" not in rows[0]
    assert seconds[0] == "sample,method,seconds"
    assert len(rows) == len(seconds) == 1 + 2
