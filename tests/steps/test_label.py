"""The step ``label`` as a person uses it: commands between the answers, mistypings, and where it stops."""

import csv
import sys

import numpy as np
import pytest

from gpca.io.arrays import save_arrays
from gpca.pairs.perturbation import CONCEPTS
from tests.steps.by_words import main

from .spoiling import refused, removed, untouched, written


@pytest.fixture
def label(registrations, tmp_path, monkeypatch, capsys):
    """Label with the given answers: those on the terminal where it is told so, else in a file."""
    monkeypatch.chdir(tmp_path)
    registrations.save("registrations.npz")
    apart = 3 * np.eye(3)[[CONCEPTS.index(concept) for concept in registrations.concept]]
    save_arrays(
        "embeddings.npz", {"h": apart, "sample": registrations.sample, "split": registrations.split}, registrations.axes
    )
    settings = '{"iterations": 5, "inducing": 6, "draws": 20}'
    given = ["registrations.npz", "--embeddings", "embeddings.npz", "--labels", "labels.csv", "--settings", settings]

    def run(*answers, terminal=False):
        (tmp_path / "answers.txt").write_text("".join(f"{answer}\n" for answer in answers))
        with (tmp_path / "answers.txt").open() as typed:
            typed.isatty = lambda: terminal
            monkeypatch.setattr(sys, "stdin", typed)
            status = main(["label", *given, "--initial", "6", "--batch", "2"])
        written = list(csv.DictReader((tmp_path / "labels.csv").open())) if (tmp_path / "labels.csv").exists() else []
        return status, [row["concept"] for row in written], capsys.readouterr()

    return run


def test_quit_keeps_the_answers_before_and_the_next_session_counts_them(label):
    status, concepts, said = label("overlap", "/quit", "noise")
    assert (status, concepts) == (0, ["overlap"])
    assert "6 labeled at the start, 0 answered before" in said.out
    status, concepts, said = label("pose")
    assert (status, concepts) == (0, ["overlap", "pose"])
    assert "6 labeled at the start, 1 answered before" in said.out


def test_retrain_learns_at_once_and_asks_the_same_question_again(label):
    _, concepts, said = label("overlap", "/retrain", "noise", "/quit")
    assert concepts == ["overlap", "noise"]
    before, after = said.out.split("learned 1 answer;", 1)
    assert before.count("BALD") == 2
    assert after.count("BALD") == 1  # the third question alone: the second one was still open
    assert "concepts: noise, pose, overlap" in after


def test_a_mistyped_name_is_asked_for_again_on_a_terminal_and_stops_a_file(label):
    status, concepts, said = label("Not a name", "overlap", terminal=True)
    assert (status, concepts) == (0, ["overlap"])
    assert "'Not a name' is not a valid concept name" in said.out
    status, concepts, said = label("Not a name", "noise")
    assert (status, concepts) == (2, ["overlap"])
    assert "'Not a name' is not a valid concept name" in said.err


FAULTS = [
    (removed("embeddings.npz"), {}, r"embeddings.npz: no such file; make it with Snakemake"),
    (untouched, {"--embeddings": None}, r"--embeddings: is missing; name the embeddings of the registrations"),
    (untouched, {"--out": "out.pt"}, r"--out: is for the queue of an explanation alone"),
    (removed("answers.txt"), {}, r"answers.txt: no such file; give a text file in UTF-8 with one answer per line"),
    (untouched, {"--known": ["noise"]}, r"starts with fewer than two labeled concepts; name two with --known"),
    (untouched, {"--strategy": "best"}, r"strategy 'best': unknown; choose one of random"),
    (
        written("labels.csv", "sample,split\n1,train\n"),
        {},
        r"labels.csv: has the columns sample,split; give sample",
    ),
    (written("labels.csv", "sample,split,concept\n99,train,pose\n"), {}, r"labels.csv, line 2: no sample '99' of"),
    (written("labels.csv", "sample,split,concept\n9,train,\n9,train,pose\n"), {}, r"line 3: 'pose' contradicts the"),
    (written("labels.csv", "sample,split,concept\n9,train,Not pose\n"), {}, r"'Not pose' is not a valid concept name"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "label", *FAULTS[fault])
