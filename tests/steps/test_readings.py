"""The step ``readings``: a file with its provenance, and what it says of a file that is not there or not named."""

import json

import pytest

from gpca.evaluation.measures import read_metrics
from gpca.experiments.specification_curve.registry import GROUPS
from tests.steps.by_words import main

GPC = {"iterations": 2, "inducing": 4, "draws": 20}


@pytest.fixture
def registrations_npz(registrations, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "registrations/tiny/seed0.npz"
    path.parent.mkdir(parents=True)
    registrations.save(path)
    return "registrations/tiny/seed0.npz"


def words(path):
    settings = json.dumps({"choices": {"features": ["counts", "residual"]}, "gpca_paper": GPC})
    files = ["--registrations", path, "--out", "readings/out.csv"]
    return ["readings", "--group", "features", "--settings", settings, *files]


def test_the_step_writes_a_row_for_each_reading_the_same_every_time(registrations_npz, tmp_path):
    assert main(words(registrations_npz)) == 0
    first = (tmp_path / "readings/out.csv").read_bytes()
    rows = read_metrics(tmp_path / "readings/out.csv")
    assert set(rows["table"]) == {"features/counts", "features/residual"}
    assert (tmp_path / "readings/out.csv.provenance.json").is_file()
    assert main(words(registrations_npz)) == 0
    assert (tmp_path / "readings/out.csv").read_bytes() == first


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("lost/tiny/seed0.npz", "no such file"),
        ("lost.npz", "is not named"),
    ],
)
def test_a_fault_ends_in_one_line_and_writes_nothing(registrations_npz, tmp_path, capsys, path, message):
    assert main(words(path)) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
    assert not (tmp_path / "readings").exists()


def test_each_group_reads_what_it_names():
    for group in GROUPS.values():
        assert set(group.reads) <= {"registrations", "sets", "predictions", "embeddings", "retrained"}
