"""The printed numbers under every reading of the choices that the paper leaves unstated (Table XIII)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args

import numpy as np

from gpca.comparison.claims import ThreeDigits
from gpca.comparison.readings import read_judged, summarize, unresolved
from gpca.declarations import Experiment, Figure, Frame, Names, Plan, Run, Step, Tidy, figure, table
from gpca.errors import InputError
from gpca.experiments import reading_words
from gpca.experiments.active_learning import learning_settings
from gpca.experiments.explained import explainer_settings
from gpca.experiments.frames import frames_of
from gpca.explainers.registry import explainer_module
from gpca.frames.source import REAL_WORLD, conditions_of
from gpca.objects.entry import stand_in_clause
from gpca.pairs.perturbation import Severities
from gpca.reporting.figures.panels import panels
from gpca.reporting.figures.style import BLUE, LIGHT_GRAY, SMALL_PT, write_title
from gpca.reporting.sheet import Cell, Column, Table, TableBuilder, plain_cell, rows_where
from gpca.settings import Keys
from gpca.steps.readings import groups
from gpca.steps.readings.groups import FRAME_REPEATS, GROUPS, OtherSeverities, ReadingSizes

RANGES = get_args(OtherSeverities)


@dataclass(frozen=True, kw_only=True)
class Section(ReadingSizes):
    """The choices that the paper leaves unstated, by group, and how much of the data the readings see.

    Attributes:
        severities: ranges that encoders learn from instead of the protocol's, for as many seeds as `encoders`.
    """

    severities: Annotated[dict, Keys(dict.fromkeys(RANGES, Severities), required=RANGES)]
    groups: Annotated[dict, Keys({name: group.values for name, group in GROUPS.items()})]


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Groups of readings, some of which are run only where there is what they read, and the parts of their jobs."""
    readings, frames = config["readings"], config["real_world"]
    estimated = [name for name, entry in conditions_of(config).items() if entry.get("form") == "results"]
    readable = {
        groups.FRAME_ENCODER: frames["published"],
        groups.FRAME_START: estimated and frames["condition_backbones"],
        groups.SEVERITIES_RETRAINED: readings["encoders"],
    }

    return {
        "reading_group": [name for name in readings["groups"] if readable.get(name, True)],
        "whole_group": [name for name in readings["groups"] if name != FRAME_REPEATS],
        "estimated": f"{REAL_WORLD}_{estimated[0]}" if estimated else "",
        "repeats": list((readings["groups"].get(FRAME_REPEATS) or {}).get("repeats", [])),
        "repeated_backbone": list(frames["backbones"]),
    }


READ_ALL = "gpca.evaluation.measures:read_all_metrics"
EXPERIMENT = Experiment(
    name="specification_curve",
    sections={"readings": Section},
    tidy=(Tidy("readings.csv", READ_ALL, {"paths": "readings/{reading_group}.csv"}, rule="reading_values"),),
    names=names,
    optional_entries={"readings.groups": Names("group of readings", lambda: GROUPS)},
)


def retrained_on(config: Mapping, severities: str) -> dict[str, Any]:
    """The section `registrations` with the severities of that name; the protocol's where there are none."""
    other = config["readings"]["severities"].get(severities)
    return config["registrations"] | ({"severities": other} if other else {})


def _files(plan: Plan, name: str) -> dict[str, list[str]]:
    config, group, readings = plan.config, GROUPS[name], plan.config["readings"]
    if name in (groups.FRAME_ENCODER, groups.FRAME_START):
        backbones, published = plan.names["backbone"], plan.names["published"]
        methods_of = {REAL_WORLD: [*backbones, *published]}
        if name == groups.FRAME_START:
            methods_of = {REAL_WORLD: backbones, plan.names["estimated"]: plan.names["condition_backbone"]}
        files: dict[str, list[str]] = {"registrations": [], "predictions": []}
        for source, methods in methods_of.items():
            files["registrations"] += [f"registrations/{source}/seed{seed}.npz" for seed in config["seeds"]]
            for method in methods:
                seeds = plan.names["published_seed"] if method in published else config["seeds"]
                files["predictions"] += [f"predictions/{source}/{method}/seed{seed}.csv" for seed in seeds]
        return files
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
    group = GROUPS[wildcards.whole_group]
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
    outputs={"out": f"readings/{FRAME_REPEATS}/{{repeats}}/{{repeated_backbone}}.csv"},
    settings=lambda plan, wildcards: {
        "choices": plan.config["readings"]["groups"][FRAME_REPEATS] | {"repeats": [wildcards.repeats]},
        **_sections(plan),
    },
    params={"group": FRAME_REPEATS},
    modules=lambda plan: [GROUPS[FRAME_REPEATS].code],
    priority=9,
    resources={"mem_mb": 4000, "runtime": 120},
)
JOIN = Step(
    name="join_repeats",
    run="gpca.steps.readings.files:join",
    inputs={"paths": f"readings/{FRAME_REPEATS}/{{*repeats}}/{{*repeated_backbone}}.csv"},
    outputs={"out": f"readings/{FRAME_REPEATS}.csv"},
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


def plain_cells(values: Mapping[str, float], seeds: float) -> dict[str, Cell | None]:
    """Cells of numbers that are means over these seeds, none where there is no number."""
    return {name: None if math.isnan(x) else plain_cell(float(x), int(seeds), 0) for name, x in values.items()}


def stand_ins(run: Run) -> str:
    return stand_in_clause([*run.sources.values(), frames_of(run.config)])


SECTION = "What the paper leaves unstated"
VERDICTS = {"judged": (read_judged, "reading_verdicts.csv")}
BEST = "Reading that is close to the most numbers"
HEADS = {
    **{"number": "Number", "unit": "Unit", "group": "What is open", "where": "Printed number"},
    **{"nearest": "Nearest reading", "close": "Readings that are close", "joint": BEST},
}
COLUMNS = {"published": "Paper", "reproduced": "Here", "least": "Least", "most": "Most", "value": "Nearest"}
CHANCE = "chance"


@table(
    SECTION,
    "Table XIII: readings of the unstated",
    """Each number of the paper that is not reproduced, and what it would be under other choices that the paper leaves
    open (readings): close to one, between them, or outside of all. The choices were fixed before they were run, and no
    reading counts as the reproduction.""",
    **VERDICTS,
)
def table13_readings(run: Run, judged: Frame) -> Table:
    """A row per missed number and group of readings that touches it; of stand-ins, per number that is touched."""
    table, every = TableBuilder("table13_readings", HEADS), []
    for key, by_group in summarize(judged).items():
        rows = rows_where(judged, **dict(zip(NUMBER, key, strict=True)))
        first = rows.iloc[0]
        for group, of in by_group.items():
            labels = (
                (" / ".join(key), ", ".join(key)),
                (first["unit"],) * 2,
                (group, reading_words.group(group)),
                (of.where,) * 2,
                (of.nearest, reading_words.reading(group, of.nearest)),
                (f"{of.close}/{of.readings}", f"{of.close} of {of.readings}"),
                (of.joint, f"{reading_words.reading(group, of.joint)} ({of.fitted} of {of.touched})"),
            )
            values = {"published": first["published"], "reproduced": first["reproduced"], CHANCE: 100 * of.chance}
            values |= {"least": of.least, "most": of.most, "value": of.value}
            table.add_row(labels, plain_cells(values, rows.loc[rows["group"] == group, "n"].max()))
            every.append(of)
    inside = [of for of in every if of.inside]
    columns: dict[str, Column] = {name: ThreeDigits(title) for name, title in COLUMNS.items()}
    return table.build(
        "The numbers that are not reproduced, under other readings of what the paper leaves unstated" + stand_ins(run),
        "value",
        columns | {CHANCE: Column("Chance (%)", decimals=0, interval=False)},
        (
            "Chance: the share of the span from Least to Most that is close to a reading (docs/comparison.md). Of the "
            f"{len(every)} rows, {len(inside)} lie within the span of their group; "
            f"{sum(of.chance for of in inside):.1f} of these would be produced by chance. Produced are "
            f"{sum(of.close > 0 for of in every)}, also by readings beside the span.",
            "Paper to Nearest are in the row's unit; Least, Most and Nearest are means over the seeds of single "
            "readings. Of a range, Paper is the lower end. No reading is the reproduction.",
            f"{BEST}: of all printed numbers that the same choices touch, also those that are reproduced; in brackets "
            "to how many of how many it is close.",
        ),
    )


NUMBER = ["table", "row", "column"]  # what names a printed number
MOST_ACROSS = 12  # numbers that stand beside each other in a bin of the figure


@figure(
    SECTION,
    "Readings of the unstated",
    """A dot for each number that is not reproduced, by the group of choices that the paper leaves open: the share of
    the group's readings that are close to it. A number at zero is not explained by the group.""",
    name="readings",
    **VERDICTS,
)
def draw_readings(run: Run, judged: Frame) -> Figure:
    """Share of close readings as a dot for each group and number; dots of one share stand side by side."""
    shares = unresolved(judged).groupby(["group", *NUMBER], sort=False)["close"].mean()
    groups = [name for name in GROUPS if name in shares.index.unique("group")]
    if not groups:
        raise InputError("reading_verdicts.csv", "has no readings of these groups", "run the readings first")
    figure, [[panel]] = panels(1, 1, 0.6 + 0.34 * len(groups))
    for y, group in enumerate(groups):
        panel.axhline(y, color=LIGHT_GRAY, linewidth=0.6, zorder=0)
        share_K, count_K = np.unique(np.round(100 * shares[group].to_numpy(float)), return_counts=True)
        for share, count in zip(share_K, count_K, strict=True):
            offset_N = (np.arange(count) % MOST_ACROSS - (min(count, MOST_ACROSS) - 1) / 2) * 0.7
            lift_N = 0.16 * (np.arange(count) // MOST_ACROSS)
            panel.scatter(share + offset_N, y - lift_N, s=7, color=BLUE, linewidths=0, zorder=3)
        explained = f"{np.sum(shares[group] > 0)} of {len(shares[group])}"
        panel.text(1.01, y, explained, transform=panel.get_yaxis_transform(), va="center", fontsize=SMALL_PT)
    panel.set_yticks(range(len(groups)), [reading_words.group(name) for name in groups], fontsize=SMALL_PT)
    panel.tick_params(axis="y", length=0)
    panel.set(ylim=(len(groups) - 0.5, -0.6), xlim=(-5, 105), xlabel="readings that are close (% of the group's)")
    write_title(figure, f"Numbers that are not reproduced{stand_ins(run)}; right: how many any reading produces")
    return figure
