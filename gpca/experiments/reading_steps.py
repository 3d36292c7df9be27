"""Steps of the readings: what a group reads, and encoders that learn from other severities."""

from collections.abc import Callable, Mapping
from typing import Any

from gpca.declarations import Plan, Step
from gpca.experiments.active_learning import learning_settings
from gpca.experiments.explained import explainer_settings
from gpca.explainers.registry import explainer_module
from gpca.frames.source import REAL_WORLD
from gpca.steps.readings import groups


def retrained_on(config: Mapping, severities: str) -> dict[str, Any]:
    """The section `registrations` with the severities of that name; the protocol's where there are none."""
    other = config["readings"]["severities"].get(severities)
    return config["registrations"] | ({"severities": other} if other else {})


def _files(plan: Plan, name: str) -> dict[str, list[str]]:
    config, group, readings = plan.config, groups.GROUPS[name], plan.config["readings"]
    if name in (groups.FRAME_ENCODER, groups.FRAME_START):
        backbones, published = plan.names["backbone"], plan.names["published"]
        methods_of = {REAL_WORLD: [*backbones, *published]}
        if name == groups.FRAME_START:
            methods_of = {REAL_WORLD: backbones, plan.names["estimated"]: plan.names["condition_backbone"]}
        return {
            "registrations": [f"registrations/{s}/seed{seed}.npz" for s in methods_of for seed in config["seeds"]],
            "predictions": [
                f"predictions/{source}/{method}/seed{seed}.csv"
                for source, methods in methods_of.items()
                for method in methods
                for seed in (plan.names["published_seed"] if method in published else config["seeds"])
            ],
        }
    sources = [source for source in group.sources if source in plan.names["source"]]
    seeds, ranges = config["seeds"][: 1 if group.costly else readings["seeds"]], list[str]()
    if name == groups.SEVERITIES_RETRAINED:
        seeds, ranges = config["seeds"][: readings["encoders"]], readings["groups"][name]["range"]
    folder, section = ("learners", "learners") if name == "diagnostics" else ("predictions", "explainers")
    methods = [method for method in group.methods if method in config[section]]
    by_seed = [(source, seed) for source in sources for seed in seeds]
    files = {
        "registrations": [f"registrations/{source}/seed{seed}.npz" for source, seed in by_seed],
        "sets": [f"shifted/{source}/seed{seed}.npz" for source, seed in by_seed],
        "predictions": [
            f"{folder}/{s}/{method}/seed{seed}.csv" for s in sources for method in methods for seed in seeds
        ],
        "retrained": [f"retrained/{name}/{s}/seed{seed}.npz" for s in sources for name in ranges for seed in seeds],
    }
    return {kind: files[kind] for kind in group.reads}


def _of_kind(kind: str) -> Callable[[Plan, Any], list[str]]:
    return lambda plan, wildcards: _files(plan, wildcards.whole_group).get(kind, [])


def _sections(plan: Plan) -> dict[str, Any]:
    """What a reading leaves as it is."""
    config = plan.config
    return {
        "sizes": {name: config["readings"][name] for name in ("seeds", "encoders", "samples")},
        "uncertainty": config["uncertainty"].get("additive", {}),
        "icp": config["registrations"]["icp"],
        "encoder": plan.encoder,
        "active_learning": learning_settings(plan),
        **{name: config["explainers"].get(name) or {} for name in ("gpca_paper", "gpca")},
        "gpca_matern": explainer_settings(config, config["learners"]).get("gpca_matern", {}),
    }


def _settings(plan: Plan, wildcards: Any) -> dict[str, Any]:
    group, sections = wildcards.whole_group, _sections(plan)
    if group in (groups.FRAME_ENCODER, groups.FRAME_START):
        frames = {"source": REAL_WORLD, "methods": plan.names["backbone"], "estimated": plan.names["estimated"]}
        published = plan.config["real_world"]["published"]
        sections = {"sizes": sections["sizes"], "frames": frames, "published": published}
    return {"choices": plan.config["readings"]["groups"][group], **sections}


def _modules(plan: Plan, wildcards: Any) -> list[str]:
    group = groups.GROUPS[wildcards.whole_group]
    encoder = [plan.encoder_module] if wildcards.whole_group == "encoder_head" else []
    return [group.code, *map(explainer_module, group.explainers), *encoder]


READ = Step(
    name="reading",
    run="gpca.steps.readings.files:run",
    inputs={kind: _of_kind(kind) for kind in ("registrations", "sets", "predictions", "embeddings", "retrained")},
    outputs={"out": "readings/{whole_group}.csv"},
    settings=_settings,
    params={"group": lambda plan, wildcards: wildcards.whole_group},
    modules_of_job=_modules,
    priority=9,
    resources={"mem_mb": 4000, "runtime": 120},
)
# Repeats on depth frames fit a classifier for each row and seed, so each kind of repeat and backbone has a job.
REPEAT = Step(
    name="repeat_on_frames",
    run="gpca.steps.readings.files:run",
    inputs={
        "registrations": "registrations/{frames}/seed{*seed}.npz",
        "predictions": lambda plan, wildcards: [
            f"predictions/{{frames}}/{wildcards.repeated_backbone}-{reduction}/seed{{*seed}}.csv"
            for reduction in plan.config["real_world"]["reductions"]
        ],
        "embeddings": lambda plan, wildcards: [
            f"embeddings/{{frames}}/{wildcards.repeated_backbone}/{reduction}/seed{{first_seed}}.npz"
            for reduction in plan.config["real_world"]["reductions"]
        ],
    },
    outputs={"out": f"readings/{groups.FRAME_REPEATS}/{{repeats}}/{{repeated_backbone}}.csv"},
    settings=lambda plan, wildcards: {
        "choices": plan.config["readings"]["groups"][groups.FRAME_REPEATS] | {"repeats": [wildcards.repeats]},
        **_sections(plan),
    },
    params={"group": groups.FRAME_REPEATS},
    modules=lambda plan: [groups.GROUPS[groups.FRAME_REPEATS].code],
    priority=9,
    resources={"mem_mb": 4000, "runtime": 120},
)
JOIN = Step(
    name="join_repeats",
    run="gpca.steps.readings.files:join",
    inputs={"paths": f"readings/{groups.FRAME_REPEATS}/{{*repeats}}/{{*repeated_backbone}}.csv"},
    outputs={"out": f"readings/{groups.FRAME_REPEATS}.csv"},
)
RETRAIN = Step(
    name="retrain",
    run="gpca.steps.readings.subsets:retrain",
    inputs={"objects": "objects/{source}.npz"},
    outputs={"out": "retrained/{severities}/{source}/seed{seed}.npz"},
    where={"source": "retrained_source"},
    settings=lambda plan, wildcards: {
        "shift": plan.config["shift"],
        "registrations": retrained_on(plan.config, wildcards.severities),
        "encoder": plan.encoder,
    },
    modules=lambda plan: [plan.encoder_module],
    priority=10,
)
