"""What experiments declare, and how their tidy files are collected."""

import inspect

import pytest

from gpca.declarations.experiment import Experiment, Tidy
from gpca.declarations.registry import experiments
from gpca.process.registry import load as load_function

COLLECTED = [tidy for each in experiments() for tidy in each.tidy if tidy.collector]


@pytest.mark.parametrize("tidy", COLLECTED, ids=lambda tidy: tidy.file)
def test_a_collector_takes_its_files(tidy):
    inspect.signature(load_function(tidy.collector)).bind(*[None] * tidy.takes_run, **dict.fromkeys(tidy.files))


def test_no_two_experiments_write_one_file_or_read_one_section():
    files = [file for each in experiments() for tidy in each.tidy for file in tidy.all_files]
    sections = [name for each in experiments() for name in each.sections]
    assert len(set(files)) == len(files)
    assert len(set(sections)) == len(sections)


def test_a_tidy_file_is_collected_from_all_names_and_an_experiment_run_where_there_are_some():
    tidy = Tidy("mine.csv", "m:f", {"files": "mine/{source}/seed{seed}.csv"})
    assert tidy.inputs({"source": ["x", "y"], "seed": [0]}) == {"files": ["mine/x/seed0.csv", "mine/y/seed0.csv"]}
    assert (tidy.target, Tidy("mine.csv", rule="mine_metrics").target) == ("mine", "mine_metrics")
    experiment = Experiment(name="mine", needs=("seed", "source"))
    assert experiment.is_run({"seed": [0], "source": ["x"]})
    assert not experiment.is_run({"seed": [0], "source": []})
