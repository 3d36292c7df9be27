"""The steps ``train_control`` and ``controls`` by hand: what they leave out, and what they say of faults."""

import numpy as np
import pandas as pd
import pytest

from tests.steps.by_words import main

from .command_lines import CONTROLS, STEP_OPTIONS, arguments, arrays_changed, refused, settings

FAULTS = {
    "train_control": [],
    "controls": [
        (arrays_changed("control.npz", sample=lambda s: s + 1), {}, "control.npz: its samples differ"),
        (arrays_changed("registrations.npz", fitness=lambda f: f - 2), {}, "'fitness' contains impossible values"),
    ],
}


@pytest.mark.parametrize(("step", "fault"), [(step, i) for step in FAULTS for i in range(len(FAULTS[step]))])
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, step, fault):
    refused(folder, capsys, step, *FAULTS[step][fault])


def test_a_control_that_the_source_does_not_admit_is_named_and_its_file_holds_no_samples(folder, capsys):
    assert main(arguments("train_control", {"--control": "unseen_objects"})) == 0
    [line] = [line for line in capsys.readouterr().err.splitlines() if "is skipped" in line]
    assert line == "control 'unseen_objects' of tiny is skipped: it needs at least 5 objects, but there are 2"
    with np.load(folder / "control.npz") as arrays:
        assert len(arrays["sample"]) == 0
    chosen = {"controls": CONTROLS | {"controls": ["unseen_objects", "shuffled"]}}
    changes = settings("controls", **chosen) | {"--retrained": "unseen_objects"}
    assert main(arguments("controls", changes)) == 0
    assert "controls of tiny: 'unseen_objects' is skipped" in capsys.readouterr().err
    rows = pd.read_csv(folder / STEP_OPTIONS["controls"]["--predictions"])
    assert set(rows["control"]) == {"paper", "shuffled"}
