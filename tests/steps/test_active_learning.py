"""The step ``active_learning`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import arrays_changed, refused, removed, settings, untouched

FAULTS = [
    (removed("without.npz"), {}, r"without.npz: no such file; make it with Snakemake"),
    (
        arrays_changed("without.npz", sample=lambda s: s + 1),
        {},
        r"without.npz: its samples differ from those of the reg",
    ),
    (arrays_changed("embeddings.npz", sample=lambda s: s + 1), {}, r"embeddings.npz: its samples differ from"),
    (untouched, settings("active_learning", held_out=["noise", "pose"]), r"array 'h_pose' is missing"),
    (untouched, settings("active_learning", initial=18), r"leaves none of 18 training samples for the pool; lower"),
    (untouched, settings("active_learning", stream={"arrivals": 60, "quiet": 2}), r"stream of 60 arrivals: needs"),
    (untouched, {"--strategies": ["random", "bald", "oracle"]}, r"strategy 'oracle': unknown; choose one of random"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "active_learning", *FAULTS[fault])
