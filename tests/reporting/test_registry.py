import inspect
import json

import pytest

from gpca.declarations import registry
from gpca.declarations.registry import registered, results_of
from gpca.process.registry import load
from gpca.reporting.registry import Input, Result, build, targets, unknown_target

NAMES = {"source": ["ycb", "mine"], "seed": [0, 1], "first_seed": "0", "explainer": ["gpca", "forest"], "gpca": "gpca"}
ENTRIES = {result.name: result for result in registered()}


def result(*inputs, **fields):
    nothing = {"only": {}, "needs": (), "paper": False}
    head = {"name": "table9_mine", "kind": "tables", "section": "S", "title": "T", "caption": "C.", "builder": "m:f"}
    return Result(**head | {"inputs": inputs} | nothing | fields)


def given(pattern, **fields):
    return Input("metrics", (pattern,), **fields)


@pytest.mark.parametrize("name", ENTRIES)
def test_every_builder_and_reader_takes_what_its_entry_gives(name):
    entry = ENTRIES[name]
    builder = inspect.signature(load(entry.builder))
    of_source = {"source"} if "{source}" in entry.name else set()
    builder.bind(None, **dict.fromkeys({each.argument for each in entry.inputs} | of_source))
    for each in entry.inputs:
        if each.read:
            inspect.signature(load(each.read)).bind(None)


def test_no_name_is_registered_twice_and_one_entry_stands_for_a_figure_of_each_source(monkeypatch):
    assert len(ENTRIES) == len(registered())
    paper = {name.split("_")[0] for name, entry in ENTRIES.items() if entry.paper}
    assert paper == {*(f"table{n}" for n in range(1, 8)), *(f"fig{n}" for n in range(1, 7))}
    objects = result(given("objects/{source}.npz"), name="objects_{source}", title="Objects: {source}")
    monkeypatch.setattr(registry, "registered", lambda: (objects,))
    ycb, mine = results_of(NAMES)
    assert (ycb.name, mine.title) == ("objects_ycb", "Objects: mine")
    assert ycb.files(NAMES) == {"metrics": "objects/ycb.npz"}
    assert (mine.arguments, objects.arguments) == ({"source": "mine"}, {})


def test_files_are_listed_where_a_name_is_a_list_and_nothing_is_made_where_one_is_empty():
    entry = result(given("predictions/{source}/{explainer}/seed{seed}.csv"), only={"explainer": ("gpca", "gone")})
    assert entry.files(NAMES) == {
        "metrics": [f"predictions/{source}/gpca/seed{seed}.csv" for source in ("ycb", "mine") for seed in (0, 1)]
    }
    assert result(given("metrics.csv")).files(NAMES) == {"metrics": "metrics.csv"}
    assert result(given("recovery/policy_seed{first_seed}.json")).files(NAMES)["metrics"].endswith("seed0.json")
    assert result().all_files == [f"tables/table9_mine.{suffix}" for suffix in ("md", "csv", "json")]
    assert result(kind="figures", name="fig").all_files == ["figures/fig.png", "figures/fig.pdf"]
    entry = result(given("predictions/{gpca}.csv"))
    assert entry.is_made(NAMES)
    assert not entry.is_made(NAMES | {"gpca": ""})
    assert not result(given("x/{explainer}.csv"), only={"explainer": ("gone",)}).is_made(NAMES)
    assert not result(given("metrics.csv"), needs=("explainer",)).is_made(NAMES | {"explainer": []})


def test_a_builder_is_given_the_run_and_what_was_read(tmp_path):
    path = tmp_path / "given.json"
    path.write_text("[1, 2]")
    readers = {"iterable": "tests.reporting.test_registry:read", "key": ""}
    built = build(
        "tests.reporting.test_registry:show", readers, {"iterable": str(path), "key": "a"}, {"source": "ycb"}, "run"
    )
    assert built == ("run", [1, 2], "a", "ycb")


def read(path):
    with open(path) as file:
        return json.load(file)


def show(run, iterable, key, source):
    return run, iterable, key, source


def test_short_names_are_the_papers_and_a_misspelt_one_is_answered():
    names = ["table1_single", "table1_extended", "fig2_overview", "reliability", "fig_confusions"]
    short = targets(result(name=name) for name in names)
    assert {key: value.name for key, value in short.items()} == {"table1": "table1_single", "fig2": "fig2_overview"}
    assert unknown_target("tabel2", ["table2", "page"]).endswith("did you mean table2?")
    assert unknown_target("xyz", ["table2", "page"]).endswith("choose one of page, table2")
