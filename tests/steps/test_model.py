"""The step ``model`` by hand, and what it says of faulty files and settings."""

import pytest

from gpca.model.file import Model
from gpca.recovery.policy import RecoveryPolicy, Thresholds
from tests.steps.by_words import main

from .command_lines import POLICY, STEP_OPTIONS, arguments, refused, removed

FAULTS = [
    (removed("weights.pt"), {}, r"weights.pt: no such weights; regenerate them with Snakemake"),
    (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with Snakemake"),
    (removed("causes.npz"), {}, r"causes.npz: no such file; make it with Snakemake"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "model", *FAULTS[fault])


def test_the_model_holds_the_policy_of_the_config_with_a_threshold_of_its_own(folder, made):
    assert Model.load(made / "model.pt").policy.thresholds.uncertain > 0
    declared = STEP_OPTIONS["model"]["--settings"] | {
        "recovery": POLICY | {"thresholds": POLICY["thresholds"] | {"uncertain": 0.125}}
    }
    assert main(arguments("model", {"--settings": declared, "--out": "declared.pt"})) == 0
    policy = Model.load(folder / "declared.pt").policy
    assert policy == RecoveryPolicy(Thresholds(0.125, 0.4, 0.1, 3), POLICY["treatments"])


def test_a_model_made_anew_is_the_same_to_the_byte(folder, made):
    assert main(arguments("model")) == 0
    assert (folder / "model.pt").read_bytes() == (made / "model.pt").read_bytes()
