"""A run as tables see it, and the record of what they read of its config."""

import json

import pytest

from gpca.declarations.plan import READ, Recorded, Run, config_token

CONFIG = {
    "seeds": [0, 1, 2],
    "success": {"error": 0.03, "curve": [0.02, 0.05]},
    "explainers": {"gpca": {"draws": 10}, "rule": None},
    "sources": {"ycb": {"title": "YCB", "kind": "bop"}, "cups": {"title": "Cups", "kind": "procedural"}},
}


def changed(**sections):
    return CONFIG | sections


@pytest.fixture
def sidecar(tmp_path):
    def write(read):
        config = Recorded(CONFIG)
        read(config)
        path = tmp_path / "table.md.provenance.json"
        path.write_text(json.dumps({READ: config.record("first")}))
        return path

    return write


def test_a_token_changes_with_the_keys_that_were_read_and_with_no_other(sidecar):
    path = sidecar(lambda config: config["success"]["error"])
    assert config_token(CONFIG, path) == "first"
    assert config_token(changed(seeds=[5], success={"error": 0.03, "curve": []}), path) == "first"
    assert config_token(changed(success={"error": 0.02}), path) != "first"
    assert config_token(changed(success=None), path) != "first"


@pytest.mark.parametrize("read", [lambda config: list(config["explainers"]), lambda config: len(config["explainers"])])
def test_the_names_of_a_section_are_read_apart_from_its_values(sidecar, read):
    path = sidecar(read)
    assert config_token(changed(explainers={"gpca": {"draws": 99}, "rule": None}), path) == "first"
    assert config_token(changed(explainers={"rule": None, "gpca": {"draws": 10}}), path) != "first"  # another order
    assert config_token(changed(explainers={"gpca": {"draws": 10}}), path) != "first"


def test_a_section_read_as_a_whole_counts_with_all_its_values_and_an_absent_key_too(sidecar):
    path = sidecar(lambda config: dict(config["success"]) | {} | config["explainers"]["gpca"])
    assert config_token(changed(success={"error": 0.03, "curve": [0.02]}), path) != "first"
    assert config_token(changed(explainers={"gpca": {"draws": 11}, "rule": None}), path) != "first"
    assert config_token(changed(seeds=[]), path) == "first"
    path = sidecar(lambda config: config.get("figures"))
    assert config_token(CONFIG, path) == "first"
    assert config_token(changed(figures={"source": "ycb"}), path) != "first"


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"config_read": {"keys": 1, "token": "x"}}'])
def test_without_a_sound_record_the_whole_config_counts(tmp_path, text):
    path = tmp_path / "table.md.provenance.json"
    whole = config_token(CONFIG, path)
    path.write_text(text)
    assert config_token(CONFIG, path) == whole != config_token(changed(seeds=[1]), path)


def test_a_run_has_titles_seeds_and_the_clause_on_stand_ins():
    run = Run(CONFIG, only={"explainer": ("rule",)})
    assert run.section("explainers") == {"rule": None} and Run(CONFIG).section("explainers") == CONFIG["explainers"]
    assert run.sources["cups"] == {"title": "Cups", "stand_in": True}
    assert run.source_titles == {"ycb": "YCB", "cups": "Cups (procedural stand-in)"}
    assert run.seeds(2) == [0, 1]
    assert "partly on procedural stand-ins" in run.stand_ins() and run.stand_ins(["ycb"]) == ""
    assert run.titles(lambda name: type("Entry", (), {"title": name.upper()}), ["gpca"]) == {"gpca": "GPCA"}
