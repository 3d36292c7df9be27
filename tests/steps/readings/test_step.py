"""The step ``reading``, the grid that was fixed beforehand, and readings in words."""

import json

import pytest
import yaml

from gpca.config.check import check
from gpca.config.layers import with_defaults
from gpca.errors import InputError
from gpca.evaluation.measures import read_metrics
from gpca.experiments import reading_words
from gpca.experiments.reading_words import ANY_NUMBER, WORDS
from gpca.process.code_files import ROOT
from gpca.process.registry import load
from gpca.steps.readings.groups import GROUPS, name_of, readings_of
from tests.steps.by_words import main

GPC = {"iterations": 2, "inducing": 4, "draws": 20}
GRID = yaml.safe_load((ROOT / "config/readings.yaml").read_text())["readings"]["groups"]


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


def test_the_jobs_of_a_group_are_joined_in_their_order(registrations_npz, tmp_path):
    assert main(words(registrations_npz)) == 0
    paths = ["--paths", "readings/out.csv", "readings/out.csv"]
    assert main(["join_repeats", *paths, "--out", "both.csv"]) == 0
    assert (
        read_metrics(tmp_path / "both.csv")["value"].tolist() == 2 * read_metrics("readings/out.csv")["value"].tolist()
    )


@pytest.mark.parametrize(("path", "message"), [("lost/tiny/seed0.npz", "no such file"), ("lost.npz", "is not named")])
def test_a_fault_ends_in_one_line_and_writes_nothing(registrations_npz, tmp_path, capsys, path, message):
    assert main(words(path)) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
    assert not (tmp_path / "readings").exists()


def test_a_group_that_needs_more_samples_than_there_are_says_how_to_get_on(run_files, tmp_path, capsys):
    choices = {"new_share": [0.33], "batch": [1], "initial": [400]}
    settings = {"choices": choices, "active_learning": run_files.settings["active_learning"]}
    [path] = run_files.sets.values()
    command = ["readings", "--group", "pool", "--settings", json.dumps(settings), "--sets", str(path)]
    assert main([*command, "--out", str(tmp_path / "pool.csv")]) == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert "readings of pool: need more training samples than the run has; raise registrations.train, or" in said
    assert "or set readings.groups.pool to false" in said
    assert not (tmp_path / "pool.csv").exists()


def test_the_grid_has_every_group_and_each_has_a_function():
    assert list(GRID) == list(GROUPS)
    for name, group in GROUPS.items():
        assert list(GRID[name]) == list(group.choices)
        assert callable(load(group.code))
        assert set(group.reads) <= {"registrations", "sets", "predictions", "embeddings", "retrained"}
        assert len({name_of(name, reading) for reading in readings_of(GRID[name])}) == len(readings_of(GRID[name]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kernel": {"kernel": ["cubic"]}}, "readings.groups.kernel.kernel.0: 'cubic' should be 'rbf', 'matern32' or"),
        ({"shap": {"starts": []}}, "readings.groups.shap.starts"),
        ({"pool": {"new_share": [1]}}, "readings.groups.pool.new_share.0: 1 should be less than 1"),
        ({"lenses": {}}, "readings.groups.lenses: unknown"),
    ],
)
def test_a_grid_that_cannot_be_run_stops_when_the_config_is_loaded(change, message):
    with pytest.raises(InputError, match=message):
        check(with_defaults({"readings": {"groups": change}}))


@pytest.mark.parametrize("group", GRID)
def test_every_reading_of_the_suite_has_words_of_its_own(group):
    names = list(GROUPS[group].choices)
    assert names == list(GRID[group])  # the order in which a reading names its values
    readings = readings_of(GRID[group])
    shown = {reading_words.reading(group, name_of(group, reading).partition("/")[2]) for reading in readings}
    assert len(shown) == len(readings)
    for reading in readings:
        for name, value in reading.items():
            assert ANY_NUMBER in WORDS[name] or all(part in WORDS[name] for part in str(value).split("+"))
