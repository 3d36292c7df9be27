"""The step ``frame_labels`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import arrays_changed, refused, settings, untouched

FAULTS = [
    (
        arrays_changed("embeddings.npz", sample=lambda s: s + 1),
        {},
        r"embeddings.npz: its samples differ from those of the regi",
    ),
    (untouched, settings("frame_labels", frame_labels={"initial": 18}), r"leaves none of 18 training samples"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "frame_labels", *FAULTS[fault])


def test_curves_are_of_every_backbone_and_of_the_pair(made):
    rows = [line.split(",") for line in (made / "frame_all_labels.csv").read_text().splitlines()[1:]]
    assert {(row[0], row[1]) for row in rows} == {("dgcnn", "overlap"), ("pair", "overlap")}
    assert [row[2] for row in rows] == ["0", "12", "0", "12"]  # none, and the whole pool of 18 samples less 6
