"""Steps of experiments as rules of the workflow."""

import json
from types import SimpleNamespace

from gpca.declarations.plan import Run
from gpca.declarations.step import Plan, Step, all_files, rule_of

NAMES = {
    "source": ["ycb", "cups"],
    "seed": [0, 1],
    "method": ["icp", "fgr", "mine"],
    "trained": ["cups"],
    "frames": "real_rgbd",
}
CONFIG = {"methods": {"icp": {"reach": 0.1}}, "success": {"error": 0.03}}
PLAN = Plan(Run(CONFIG), NAMES, {})


class Wildcards(SimpleNamespace):
    """Names as attributes and as items, as those of Snakemake."""

    def items(self):
        return vars(self).items()


def step(**changes):
    given = {
        "name": "register",
        "run": "gpca.seeds:generator",
        "inputs": {"objects": "objects/{source}.npz", "pairs": "pairs/{source}/seed{*seed}.npz"},
        "outputs": {"rows": "methods/{source}/{*method}/seed{*seed}.csv"},
        "settings": ("methods", "success.error"),
    }
    return Step(**given | changes)


def test_wildcards_have_a_job_each_and_lists_one_for_all():
    rule = rule_of(step(), PLAN)
    assert rule.inputs == {
        "objects": "objects/{source}.npz",
        "pairs": ["pairs/{source}/seed0.npz", "pairs/{source}/seed1.npz"],
    }
    assert rule.outputs["rows"] == [
        f"methods/{{source}}/{method}/seed{seed}.csv" for method in NAMES["method"] for seed in (0, 1)
    ]
    assert rule.params == {"methods": NAMES["method"], "seeds": [0, 1]}
    assert rule.constraints == {"source": "ycb|cups"}
    assert rule.place == "register/{source}"
    assert json.loads(rule.settings) == {"methods": {"icp": {"reach": 0.1}}, "error": 0.03}
    assert rule.modules == ("gpca.seeds:generator",)
    assert len(all_files(step(), PLAN)) == 2 * 3 * 2


def test_a_name_may_stand_for_the_values_of_another_and_a_single_value_is_filled_in():
    other = step(
        inputs={"frames": "frames/{frames}.npz"},
        outputs={"out": "out/{frames}/{source}.csv"},
        where={"source": "trained"},
    )
    rule = rule_of(other, PLAN)
    assert rule.inputs["frames"] == "frames/real_rgbd.npz"
    assert (rule.outputs["out"], rule.constraints) == ("out/real_rgbd/{source}.csv", {"source": "cups"})
    assert all_files(other, PLAN) == ["out/real_rgbd/cups.csv"]


def test_functions_are_asked_for_every_job():
    dynamic = step(
        inputs={"others": lambda plan, wildcards: [f"objects/{name}.npz" for name in plan.names["source"]]},
        settings=lambda plan, wildcards: {"seed": wildcards.source},
        params={"title": lambda plan, wildcards: wildcards.source.upper(), "fixed": 3},
        modules_of_job=lambda plan, wildcards: ["gpca.portable"] if wildcards.source == "ycb" else [],
    )
    rule = rule_of(dynamic, PLAN)
    job = Wildcards(source="ycb")
    assert rule.inputs["others"](job) == ["objects/ycb.npz", "objects/cups.npz"]
    assert json.loads(rule.settings(job)) == {"seed": "ycb"}
    assert (rule.params["title"](job), rule.params["fixed"]) == ("YCB", 3)
    assert [("gpca.portable" in rule.modules(Wildcards(source=name))) for name in ("ycb", "cups")] == [True, False]


def test_lists_have_the_plural_of_their_name_and_data_comes_from_outside_the_run():
    rule = rule_of(step(outputs={"out": "curves/{*strategy}.csv"}, where={"strategy": "method"}), PLAN)
    assert rule.params["strategies"] == NAMES["method"]
    rule = rule_of(step(data=lambda plan, wildcards: [f"data/{wildcards.source}.ply"]), PLAN)
    assert rule.data["data"](Wildcards(source="ycb")) == ["data/ycb.ply"]
    assert rule_of(step(), PLAN).data == {}
