"""What ``explain`` queues, ``label`` asks about, and the model's own classifier learns it."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.policy import RecoveryPolicy, Thresholds
from gpca.model.file import Model
from tests.steps.by_words import main


@pytest.fixture
def queued(model, registrations, tmp_path, monkeypatch, capsys):
    """Two registrations that were queued by a model that always queues; capsys is empty."""
    monkeypatch.chdir(tmp_path)
    levels = tuple(replace(level, threshold=0.0) for level in model.diagnoser.levels)
    always = replace(model.diagnoser, levels=levels, start_threshold=0.0)
    replace(model, diagnoser=always, policy=RecoveryPolicy(Thresholds(uncertain=0.0))).save("model.pt")
    for row, name in ((0, "first"), (1, "second")):
        scale = registrations.diameter_m[row]
        np.save(f"{name}.npy", scale * registrations.cloud(row))
        np.save(f"{name}_target.npy", scale * registrations.target(row))
        words = ["explain", f"{name}.npy", f"{name}_target.npy", "--model", "model.pt", "--fast"]
        assert main([*words, "--queue", "queued.npz"]) == 0
        assert f"queued in queued.npz, which holds {row + 1}\n" in capsys.readouterr().err
    return tmp_path


def label(answers, *more):
    with open("answers.txt", "w") as file:
        file.writelines(f"{answer}\n" for answer in answers)
    words = ["label", "queued.npz", "--labels", "labels.csv", "--answers", "answers.txt"]
    return main([*words, "--model", "model.pt", *more])


def concepts():
    with open("labels.csv") as file:
        return [row["concept"] for row in csv.DictReader(file)]


def test_what_explain_queues_is_labeled_and_learned(queued, capsys):
    assert label(["overlap", "overlap"], "--out", "learned.pt") == 0
    said = capsys.readouterr().out
    assert "0 labeled at the start, 0 answered before, 2 samples" in said
    assert "first.npy to first_target.npy" in said
    assert concepts() == ["overlap", "overlap"]
    before, after = Model.load("model.pt"), Model.load("learned.pt")
    assert len(after.gpc.learned_N_d) == len(before.gpc.learned_N_d) + 2
    with np.load("queued.npz") as queue:
        scores = [model.gpc.attribute(queue["h"])[0][:, 2].sum() for model in (before, after)]
    assert scores[1] > scores[0]


def test_a_new_concept_is_labeled_but_no_model_file_holds_it(queued, capsys):
    assert label(["glare", "overlap"], "--out", "learned.pt") == 2
    assert "cannot hold the new concept glare; the labels are kept" in capsys.readouterr().err
    assert concepts() == ["glare", "overlap"]
    assert not (queued / "learned.pt").exists()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--embeddings", "queued.npz"], "--embeddings: is not for the queue of an explanation"),
        (["--predictions", "out.csv"], "--predictions: is not for the queue"),
        (["--settings", '{"draws": 9}'], "--settings: are those of the model"),
    ],
)
def test_options_that_do_not_go_with_a_queue_are_refused(queued, capsys, more, message):
    assert label([], *more) == 2
    assert message in capsys.readouterr().err
