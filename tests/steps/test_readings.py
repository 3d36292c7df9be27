"""The step ``readings`` by hand: a file with its provenance, and what it says of faults."""

import json

import pytest

from gpca.attribution.metrics import read_metrics
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


def words(group="features", settings=None, **files):
    settings = settings or {"choices": {"features": ["counts", "residual"]}, "gpca_paper": GPC}
    given = [word for kind, path in files.items() for word in (f"--{kind}", path)]
    return ["readings", "--group", group, "--settings", json.dumps(settings), *given, "--out", "readings/out.csv"]


def test_the_step_writes_a_row_for_each_reading_the_same_every_time(registrations_npz, tmp_path):
    assert main(words(registrations=registrations_npz)) == 0
    first = (tmp_path / "readings/out.csv").read_bytes()
    rows = read_metrics(tmp_path / "readings/out.csv")
    assert set(rows["table"]) == {"features/counts", "features/residual"}
    assert (tmp_path / "readings/out.csv.provenance.json").is_file()
    assert main(words(registrations=registrations_npz)) == 0
    assert (tmp_path / "readings/out.csv").read_bytes() == first


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"group": "features", "settings": {"choices": {}}}, "choices of features: lack 'features'"),
        ({"settings": {"choices": {"features": ["mass"]}}}, "'mass' is not one of"),
        ({"settings": {"choices": {"features": ["all"]}, "weather": {}}}, "setting weather: unknown"),
        ({"registrations": None}, "--registrations: readings of features read registrations; give at least one file"),
        ({"registrations": "lost/tiny/seed0.npz"}, "no such file"),
        ({"registrations": "lost.npz"}, "is not named"),
        ({"sets": "shifted/tiny/seed0.npz"}, "--sets: readings of features read registrations; leave it out"),
        ({"group": "mass"}, "invalid choice: 'mass'"),
    ],
)
def test_a_fault_ends_in_one_line_and_writes_nothing(registrations_npz, tmp_path, capsys, change, message):
    given = {"registrations": registrations_npz} | change
    command = words(**{name: value for name, value in given.items() if value is not None})
    try:
        status = main(command)
    except SystemExit as stop:  # of the options themselves
        status = stop.code
    assert status == 2
    said = capsys.readouterr().err
    assert message in said
    assert len(said.splitlines()) == 1
    assert not (tmp_path / "readings").exists()


def test_each_group_reads_what_it_names():
    for group in GROUPS.values():
        assert set(group.reads) <= {"registrations", "sets", "poses", "predictions", "embeddings"}
