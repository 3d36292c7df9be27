"""Parts of experiments that a source does not admit are skipped by name; a missing package is refused by name."""

import numpy as np
import pandas as pd
import pytest

from .by_words import main
from .command_lines import CONTROLS, STEP_OPTIONS, arguments, settings
from .spoiling import refused, untouched


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


EXCHANGE = STEP_OPTIONS["exchange"]["--settings"]["exchange"]


@pytest.mark.parametrize(
    ("step", "changes"),
    [
        ("exchange", settings("exchange", exchange=EXCHANGE | {"methods": ["point_to_point", "gicp_small"]})),
        ("register_methods", {"--methods": ["fgr", "gicp_small"]}),
    ],
)
def test_a_method_whose_package_is_missing_is_refused_by_name(folder, capsys, monkeypatch, step, changes):
    monkeypatch.setattr("gpca.alignment.methods.registry.find_spec", lambda package: None)
    message = r"registration method 'gicp_small': needs the package small_gicp; install it or leave the method out"
    refused(folder, capsys, step, untouched, changes, message)
