"""Combinations of choices, and the grid that was fixed beforehand."""

import pytest
import yaml

from gpca.code_files import ROOT
from gpca.config.check import check
from gpca.config.layers import with_defaults
from gpca.errors import InputError
from gpca.experiments.specification_curve.registry import GROUPS
from gpca.experiments.specification_curve.settings import name_of, readings_of

GRID = yaml.safe_load((ROOT / "config/readings.yaml").read_text())["readings"]["groups"]


def test_readings_are_all_combinations_and_their_names_say_which():
    readings = readings_of({"floor": [1e-6, 1e-4], "sign": ["signed", "absolute"]})
    assert [name_of("shap", reading) for reading in readings] == [
        *("shap/1e-06/signed", "shap/1e-06/absolute", "shap/0.0001/signed", "shap/0.0001/absolute")
    ]


def test_the_grid_has_every_group_and_each_has_a_function():
    assert list(GRID) == list(GROUPS)
    for name, group in GROUPS.items():
        assert list(GRID[name]) == list(group.choices)
        assert callable(group.function())
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
