"""The step ``recover`` on the smallest tables, and what it says of names that it does not know."""

import json

import pandas as pd
import pytest

from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.recovery import as_samples, register_situations
from tests.failures import LOOP
from tests.steps.by_words import main

from ..config.test_check import load
from ..frames.tiny import surfaces

POLICIES = ["gpca_gated", "utility", "error_only", "reenact_gated", "softmax_head", "always_new_view"]
OTHERS = {"--policy": "policy.json", "--example": "example.npz"}


@pytest.fixture(autouse=True)
def tiny_objects(monkeypatch):
    """Five simple objects in place of a family; to find how those of a family rest takes seconds."""
    monkeypatch.setattr("gpca.objects.procedural.surfaces", lambda family: surfaces())


def settings(**changed):
    config = load("smoke")
    recovery = config["recovery"] | {
        "policies": POLICIES,
        "loop": {"failures": 1, "good": 2, "tries": 8, "budget": 1},
        "rehearsals": 1,
        "train": 9,
        "calibration": 6,
        "tables": 2,
        "noise_scale": [5, 8],
    }
    encoder = config["encoders"]["dgcnn"] | {"draw_points": 32, "epochs": 1, "draws": 1, "options": {"k": 4}}
    given = {
        "recovery": recovery | changed,
        "success": config["success"],
        "objects": config["sources"]["ycb"],
        "scenes": config["real_world"]["scenes"] | {"objects": [3, 3]},
        "registrations": config["registrations"] | {"cloud_points": 256},
        "encoder": encoder,
        "uncertainty": {"starts": 13, "icp_points": 32},
        "explainers": {"gpca": {"iterations": 5, "inducing": 4, "draws": 20}, "softmax_head": None},
    }
    return json.dumps(given)


def call(folder, given):
    files = {"--rows": "seed7.csv", "--timings": "t/seed7.csv"} | OTHERS
    paths = [word for option, name in files.items() for word in (option, str(folder / name))]
    return main(["recover", "--seed", "7", "--settings", given, *paths])


def test_the_step_writes_rows_seconds_thresholds_and_an_example(tmp_path):
    assert call(tmp_path, settings()) == 0
    rows, seconds = (pd.read_csv(tmp_path / name) for name in ("seed7.csv", "t/seed7.csv"))
    assert set(rows["policy"]) == set(POLICIES)
    assert set(rows.loc[rows["failed"], "cause"]) <= set(CONCEPTS)
    assert set(rows["table"]) <= {0, 1}
    assert len(seconds) == len(rows)
    assert (rows["failed"] == (rows.groupby(["episode", "policy"])["error_before"].transform("first") >= 0.03)).all()
    policy = json.loads((tmp_path / "policy.json").read_text())
    assert 0 <= policy["thresholds"]["uncertain"] < 1.1
    assert 0 <= policy["thresholds"]["gate"] <= 1
    assert 0 <= policy["thresholds"]["alarm"] <= 1
    assert sorted(policy["order"]) == ["denoise", "new_view", "reinitialize"]
    assert call(tmp_path / "again", settings()) == 0
    for name in ("seed7.csv", "policy.json", "example.npz"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "again" / name).read_bytes()
    for name in ("seed7.csv", "t/seed7.csv", "policy.json", "example.npz"):
        assert (tmp_path / f"{name}.provenance.json").is_file()


@pytest.mark.parametrize(
    ("changed", "fault"),
    [
        ({"policies": ["gpac"]}, "recovery policy 'gpac': unknown; choose one of gpca, "),
        ({"actions": {"pray": {}}}, "recovery action 'pray': unknown"),
    ],
)
def test_a_fault_is_one_line(changed, fault, tmp_path, capsys):
    assert call(tmp_path, settings(**changed)) == 2
    assert fault in capsys.readouterr().err
    assert not (tmp_path / "seed7.csv").exists()


def test_the_classifier_learns_from_all_causes(situations):
    registered = register_situations(situations, 6, 3, LOOP)
    assert [episode.number for episode in registered["train"]] == list(range(6))
    registrations = as_samples(registered)
    assert registrations.concept.tolist() == list(CONCEPTS) * 3
    assert registrations.split.tolist() == ["train"] * 6 + ["test"] * 3
