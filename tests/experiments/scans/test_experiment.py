"""What a config says of scans."""

import pytest
import yaml

from gpca.code_files import ROOT
from gpca.config.layers import with_defaults
from gpca.errors import InputError
from gpca.experiments.scans.experiment import EXPERIMENT, check, missing, names, shown
from gpca.experiments.scans.settings import ChoiceSettings, part
from tests.scans.test_source import write_npz


@pytest.fixture
def config():
    return with_defaults({})


def test_data_sets_that_are_there_are_registered(config, tmp_path):
    assert names(config, {})["scan_set"] == ["virtual_scans"]
    assert names(config, {})["scan_benchmark"] == []
    assert "3DMatch and 3DLoMatch" in missing(config)
    write_npz(tmp_path / "scans/3dmatch/floor.npz")
    there = config | {"data_dir": str(tmp_path)}
    assert names(there, {})["scan_set"] == ["virtual_scans", "threedmatch"]
    assert names(there, {})["scan_benchmark"] == ["threedmatch"]
    titles = shown(there, {})["scan_titles"]
    assert titles["virtual_scans"] == "Virtual rooms and objects (procedural stand-in)"
    assert titles["threedmatch"] == "3DMatch and 3DLoMatch"
    check(there, lambda key: set())


def test_every_method_of_the_config_has_settings_for_scans(config):
    assert set(config["scans"]["methods"]) == set(config["methods"])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("methods", {"gicp": {"voxel": 1}}, r"scans.methods.gicp: registration method 'gicp': setting voxel: unknown"),
        ("global_start", "gicp", r"scans.global_start: registration method 'gicp': needs an initial pose"),
        ("global_start", "icp", r"scans.global_start: no registration method 'icp'"),
        ("datasets", {"ycb": {"title": "T", "kind": "virtual", "rooms": 1}}, "scans.datasets.ycb: is the name of a"),
        (
            "datasets",
            {"t": {"title": "T", "kind": "npz", "location": "no"}},
            r"scans.datasets.t: .*no such file or fol",
        ),
    ],
)
def test_faults_of_a_config(config, key, value, message):
    with pytest.raises(InputError, match=message):
        check(config | {"scans": config["scans"] | {key: value}}, lambda key: set())


def test_strata_ascend_and_the_smoke_run_has_the_virtual_set_alone(config):
    with pytest.raises(InputError, match=r"strata: \[0.3, 0.1\] is not in ascending order"):
        part(ChoiceSettings, config["scans"] | {"strata": [0.3, 0.1]})
    smoke = yaml.safe_load((ROOT / "config/smoke.yaml").read_text())["scans"]["datasets"]
    assert {name for name in config["scans"]["datasets"] if smoke[name] is False} == set(smoke) - {"virtual_scans"}
    assert EXPERIMENT.has_rules
