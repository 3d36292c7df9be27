"""The steps of the joint reading, one after the other at tiny size: a search on one source, its reading on another."""

import json

import pandas as pd
import pytest
import yaml

from gpca.comparison.joint_reading import numbers_asked, read_choices, read_verdicts
from gpca.comparison.published import read_published
from gpca.comparison.readings import READING_COLUMNS
from gpca.declarations.plan import Run
from gpca.evaluation.measures import TIDY_COLUMNS, read_metrics, write_metrics
from gpca.experiments.joint_reading import judge_joint, table16_joint_reading
from gpca.objects.canonical import write_objects
from gpca.objects.procedural import surfaces
from gpca.process.code_files import ROOT
from tests.steps.by_words import main

GPC = {"inducing": 4, "draws": 20}
ENCODER = {"draw_points": 32, "draws": 1, "epochs": 1, "options": {"k": 4, "point_features": 8}}
REGISTRATIONS = {"train": 18, "test": 6, "cloud_points": 128, "icp": {"max_iterations": 5}}
SHIFT = {"samples": 3, "shape_points": 16, "neighbours": 3, "severities": {"noise": [0.03, 0.05]}}
CHOICES_TRIED = {
    **{"severities": ["protocol", "weaker"], "inputs": ["standardised", "unit_norm"], "inducing": ["kmeans"]},
    **{"lengthscale": ["median"], "batch": ["minibatch"], "kernel": ["rbf"], "new_share": [0.2], "knobs": ["middle"]},
    **{"set": ["in_distribution", "in_distribution+severity"], "distance": ["knn_embedding"]},
}
WEAKER = {"noise": [0.005, 0.015]}
SECTIONS = {
    "sizes": {"samples": 3},
    "gpca_paper": GPC,
    "active_learning": {"initial": 4, "target": 0.9, "gpc": GPC},
    "labels": {"batch": 2, "labels": 2},
    "uncertainty": {"starts": 13, "icp_points": 32, "samples": 3},
    "icp": {"max_iterations": 5},
}
TOLERANCES = yaml.safe_load((ROOT / "config/config.yaml").read_text())["comparison"]["tolerances"]
OF_SEARCH = {"choices": CHOICES_TRIED, "stands_for": "ycb", "deals": 10, "tolerances": TOLERANCES}


def run(step, settings, **files):
    words = [word for name, value in files.items() for word in (f"--{name}", *value.split())]
    return main([step, "--settings", json.dumps(settings), *words])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Everything up to the choice."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("joint")
        patch.chdir(folder)
        patch.setattr("gpca.steps.joint_readings.scheduled", hardly_trained)
        for source in ("shapes", "ycb"):
            write_objects(list(surfaces("coffee_cup"))[:2], source, folder / f"{source}.npz", 1024)
            for severities in ("protocol", "weaker"):
                registrations = REGISTRATIONS | ({"severities": WEAKER} if severities == "weaker" else {})
                settings = {"shift": SHIFT, "registrations": registrations, "encoder": ENCODER}
                out = f"retrained/{severities}/{source}/seed0.npz"
                assert run("retrain", settings, source=source, seed="0", objects=f"{source}.npz", out=out) == 0
        for severities in ("protocol", "weaker"):
            settings = SECTIONS | {"choices": CHOICES_TRIED, "registrations": REGISTRATIONS}
            sets, out = f"retrained/{severities}/shapes/seed0.npz", f"{severities}/seed0.csv"
            named = {"source": "shapes", "seed": "0", "severities": severities, "objects": "shapes.npz"}
            assert run("measure_joint", settings, **named, sets=sets, out=out) == 0
        measured = "protocol/seed0.csv weaker/seed0.csv"
        outputs = {"choice": "choice.csv", "best": "best.csv", "scores": "development.csv"}
        assert run("choose_joint", OF_SEARCH, measured=measured, **outputs) == 0
        severities = {"severities": {"weaker": {"severities": WEAKER}}, "registrations": REGISTRATIONS}
        files = {"sets": "retrained/protocol/ycb/seed0.npz", "other_sets": "retrained/weaker/ycb/seed0.npz"}
        of_source = {"source": "ycb", "objects": "ycb.npz", "choice": "choice.csv", "out": "ycb.csv"}
        assert run("apply_joint", SECTIONS | severities, **of_source, **files) == 0
        yield folder


def hardly_trained(section, schedule):
    """The classifier of a row of Table IV after two iterations."""
    from gpca.classifier.settings import GPCSettings

    return GPCSettings(**section, kernel=schedule[0], learning_rate=schedule[1], iterations=2)


def test_the_reading_gives_every_number_of_its_source_a_value(folder, monkeypatch):
    monkeypatch.chdir(folder)
    numbers = numbers_asked(read_published(), ["ycb"])
    rows = [(*number.key, number.value, "False") for number in numbers[:-1]] + [(*numbers[-1].key, "", "False")]
    pd.DataFrame(rows, columns=["table", "row", "column", "reproduced", "at_least"]).to_csv("comparison.csv")
    first = (*numbers[0].key, "%", 30.0, 30.0, 30.0, "close", "shap", "x", 30.0, False, 1, 0.0, True, 0.5)
    pd.DataFrame([first], columns=list(READING_COLUMNS)).to_csv("reading_verdicts.csv", index=False)
    objects = {"title": "Shapes", "kind": "procedural", "stand_in": False}
    judged = Run(
        {
            "joint_reading": {"deals": 10, "objects": objects},
            "comparison": {"tolerances": TOLERANCES},
            "sources": {"ycb": {"title": "YCB", "stand_in": True}},
            "real_world": {"title": "", "datasets": []},
            "data_dir": None,
        }
    )
    frames = judge_joint(judged, ["ycb.csv"], "comparison.csv", "reading_verdicts.csv", "development.csv")
    for frame, name in zip(frames, ("verdicts.csv", "scores.csv"), strict=True):
        write_metrics(frame, name)
    verdicts = read_verdicts(folder / "verdicts.csv")
    assert len(verdicts) == len(numbers)
    assert verdicts["close"].tolist() == [True] * (len(numbers) - 1) + [False]
    assert (verdicts["n"] == 1).all()
    assert verdicts[["readings", "readings_close"]].iloc[0].tolist() == [1, 1]
    scores = read_metrics(folder / "scores.csv")
    assert list(scores.columns) == list(TIDY_COLUMNS)
    assert set(scores["source"]) == {"development", "evaluation"}
    table = table16_joint_reading(judged, verdicts, scores, read_choices(folder / "choice.csv"))
    assert len(table.rows) == len(numbers)
    assert "found on Shapes" in table.footnotes[0]


def test_severities_without_an_encoder_are_refused_in_one_line(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    choice = pd.read_csv("choice.csv")
    choice.loc[choice["choice"] == "severities", "value"] = "stronger"
    choice.to_csv("other.csv", index=False)
    of_source = {"source": "ycb", "objects": "ycb.npz", "choice": "other.csv", "out": "none.csv"}
    files = {"sets": "retrained/protocol/ycb/seed0.npz", "other_sets": "retrained/weaker/ycb/seed0.npz"}
    settings = SECTIONS | {"registrations": REGISTRATIONS, "severities": {}}
    assert run("apply_joint", settings, **of_source, **files) == 2
    assert "needs encoders of stronger perturbations; raise readings.encoders" in capsys.readouterr().err
    assert not (folder / "none.csv").exists()
