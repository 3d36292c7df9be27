"""Guarantees for statements about causes: nominal and measured errors of sets of states and an alarm (Table XIX)."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.declarations import Experiment, Frame, LeftOut, Paths, Run, Step, figure, numbers, table
from gpca.errors import InputError
from gpca.evaluation.intervals import interval, pigeonhole_weights
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.frame_causes import FEWEST_FAILURES
from gpca.explainers.interface import EMBEDDINGS, REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry, explainer_module
from gpca.frames.source import REAL_WORLD
from gpca.guarantee import answers as asked_for
from gpca.guarantee.answers import COVERAGE, FALSE_ALARMS, FAMILIES, MISSED, SHARES, SINGLE, SIZE, UNSURE
from gpca.guarantee.guarantee import STATES
from gpca.io.csv_file import read_numbers
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import BLUE, COLUMN_WIDTH_IN, GRAY, GREEN, PURPLE, SMALL_PT, VERMILION
from gpca.reporting.sheet import Row, Sheet, Show, crossed, show, where
from gpca.seeds import generator
from gpca.settings import Distinct, read_settings

NAME = "guarantee"
ROWS = ("condition", "source", "method", "variant")  # columns that distinguish the rows of tables
COLUMNS = (
    *("table", *ROWS, "metric", "concept", "promised"),
    *("families", "samples", "clusters", "seeds", "value", "low", "high"),
)
NUMBERS = COLUMNS[7:]


@dataclass(frozen=True, kw_only=True)
class Section(asked_for.GuaranteeSettings):
    """The guarantees, and the explainers of causes that they are made for."""

    explainers: Distinct[str]


def check(config: dict, _left_out: LeftOut) -> None:
    for name in config[NAME]["explainers"]:
        if explainer_entry(name, CAUSES).reads not in ("descriptors", REENACTED, EMBEDDINGS):
            fault = f"explainer '{name}' reads neither descriptors nor re-enactments nor embeddings"
            raise InputError("config key guarantee.explainers", fault, "leave it out")


EXPERIMENT = Experiment(
    name=NAME,
    sections={NAME: Section},
    names=lambda config, sources: {"guaranteed": list(config[NAME]["explainers"])},
    check=check,
    lists={"guarantee.explainers": "diagnosis.explainers"},
)


SCORE = Step(
    name="guarantee_scores",
    run="gpca.steps.guarantee",
    inputs={
        "causes": "causes/{*source}/seed{*seed}.npz",
        "descriptors": "descriptors/{*source}/seed{*seed}.npz",
        "reenactments": "reenactments/{*source}/seed{*seed}.npz",
        "diagnoses": "diagnoses/{*source}/{*guaranteed}/seed{*seed}.csv",
        "frame_causes": "frame_causes/seed{*frame_cause_seed}.npz",
        "frame_samples": "frame_causes/seed{*frame_cause_seed}.csv",
        "frame_predictions": "frame_diagnoses/seed{*frame_cause_seed}.csv",
    },
    outputs={"scores": "guarantee/{*guaranteed}.csv"},
    settings=lambda plan, wildcards: {
        "explainers": {name: plan.config["diagnosis"]["explainers"][name] for name in plan.names["guaranteed"]}
    },
    modules=lambda plan: (explainer_module(name, CAUSES) for name in plan.names["guaranteed"]),
    priority=3,
)


@numbers("guarantee.csv", rule="guarantee_metrics", score_files="guarantee/{guaranteed}.csv")
def collect(run: Run, score_files: Paths) -> Frame:
    """Values with 95 % intervals of a bootstrap over families and seeds, from files named ``…/{explainer}.csv``."""
    import pandas as pd

    section = {name: value for name, value in run.config[NAME].items() if name != "explainers"}
    settings = read_settings(asked_for.GuaranteeSettings, section)
    rows: list[tuple] = []
    for path in score_files:
        scored = asked_for.Scored.load(path)
        for condition in asked_for.conditions(scored):
            rows += _rows_of_condition(Path(path).stem, scored, condition, settings)
    return pd.DataFrame(rows, columns=list(COLUMNS))


def read_guarantee(path: str | Path) -> Frame:
    """Read the rows of :func:`collect`; a value that has no nominal limit has no `promised`."""
    return read_numbers(path, COLUMNS, NUMBERS, optional=("promised", "low", "high"))


def _rows_of_condition(
    explainer: str, scored: asked_for.Scored, condition: asked_for.Condition, settings: asked_for.GuaranteeSettings
) -> Iterator[tuple]:
    if (answers := asked_for.answers_of(scored, condition, settings)) is None:
        return
    name, asked = condition.name, scored.subset(answers.row)
    # All samples of a family and a seed are drawn together, so sums over them are enough.
    keys_A = np.char.add(np.char.add(asked.seed.astype(str), " "), asked.family)
    _, first_C, group_A = np.unique(keys_A, return_index=True, return_inverse=True)
    drawn_B_C = pigeonhole_weights(generator("guarantee intervals", name), asked.seed[first_C], asked.family[first_C])
    masks = {source: asked.source == source for source in dict.fromkeys(asked.source.tolist())}
    masks = masks if len(masks) == 1 else {POOLED: np.ones(len(asked), bool)} | masks
    measured = list(asked_for.measures(asked, answers, settings))
    for source, inside_A in masks.items():
        by_state = name == FAMILIES and source == next(iter(masks))
        for variant, metric, concept, promised, value_A, counted_A in measured:
            mask_A = inside_A & counted_A
            if not mask_A.any() or (concept != ALL and not by_state):
                continue
            weight_C = np.bincount(group_A[mask_A], asked.weight[mask_A], len(first_C))
            sum_C = np.bincount(group_A[mask_A], asked.weight[mask_A] * value_A[mask_A], len(first_C))
            with np.errstate(invalid="ignore"):
                values_B = (drawn_B_C * sum_C).sum(axis=1) / (drawn_B_C * weight_C).sum(axis=1)
            value_B = np.append(float(sum_C.sum() / weight_C.sum()), values_B)
            # Several models may have scored a sample, which counts once.
            samples = len(set(zip(asked.source[mask_A], asked.seed[mask_A], asked.sample[mask_A], strict=True)))
            drawn_B_c = drawn_B_C[:, weight_C > 0] if metric in SHARES else None
            counts = (len(set(column[mask_A].tolist())) for column in (asked.family, asked.seed))
            yield (
                *(NAME, name, source, explainer, variant, metric, concept, promised, answers.families),
                *(samples, *counts, *interval(value_B, drawn_B_c, samples=samples)),
            )


SECTION = "Beyond the paper: what made a registration fail"
INPUT = {"measured": (read_guarantee, "guarantee.csv")}
CALIBRATED = {
    asked_for.PLAIN: "None: scores as they are",
    asked_for.BY_SAMPLE: "By sample",
    asked_for.BY_STATE: "By sample, each state",
    asked_for.BY_FAMILY: "By family",
}
WORST = "worst_state"
NUMBER: dict[str, Any] = {"interval": False, "decimals": 0, "limits": (0.0, inf), "factor": 1}
SIZES: dict[str, Any] = {"decimals": 2, "limits": (0.0, float(len(STATES))), "factor": 1, "least_is_best": True}
COLUMNS_OF_ALL = {
    COVERAGE: show(COVERAGE, "Coverage (%)"),
    WORST: show(WORST, "Of the worst state (%)"),
    SIZE: show(SIZE, "States in a set", **SIZES),
    SINGLE: show(SINGLE, "One state alone (%)", interval=False),
    MISSED: show(MISSED, "Missed failures (%)", least_is_best=True),
    FALSE_ALARMS: show(FALSE_ALARMS, "False alarms (%)", least_is_best=True),
    UNSURE: show(UNSURE, "Not sure (%)", least_is_best=True),
    "families": show("families", "Families", **NUMBER),
    "samples": show("samples", "n", **NUMBER),
}


def _by(variant: str, metric: str, title: str = "") -> Show:
    column = COLUMNS_OF_ALL[metric]
    return replace(column, title=title or column.title, where={**column.where, "variant": variant})


COLUMNS_OF_SHIFT = {
    **{name: _by(asked_for.BY_SAMPLE, name) for name in (COVERAGE, SIZE)},
    "each_state_coverage": _by(asked_for.BY_STATE, COVERAGE, "Each state: coverage (%)"),
    "each_state_set_size": _by(asked_for.BY_STATE, SIZE, "Each state: states in a set"),
    **{name: _by(asked_for.BY_SAMPLE, name) for name in (MISSED, FALSE_ALARMS, UNSURE, "samples")},
}


@table(
    SECTION,
    "Table XIX: a guarantee for what is stated about causes",
    """A set that holds the true state, which is nominal, one cause, or several, as often as is guaranteed; and an alarm
    that reports good, failed or not sure, and seldom errs. Explainers are trained on some families of shapes,
    calibrated on others, and tested on a family that is among neither, where a guarantee by sample may break.""",
    **INPUT,
)
def table19_guarantee(run: Run, measured):
    pooled = _of_all_sources(where(measured, {"condition": FAMILIES}))
    heads = {"explainer": "Explainer", "calibrated": "Calibrated"}
    rows = crossed(("method", _titles(run)), ("variant", CALIBRATED))
    sheet = Sheet("table19_guarantee", heads, rows, COLUMNS_OF_ALL, _with_counts(pooled))
    names = ("level", "missed", "false_alarms", "family_risk")
    level, missed, false_alarms, family_risk = (f"{100 * run.config[NAME][name]:g}" for name in names)
    notes = (
        f"Guaranteed: sets that hold the state in {level} % of the cases (Coverage); at most {missed} % of the failed "
        f"called good (Missed failures) and {false_alarms} % of the nominal called failed (False alarms), by family "
        f"{family_risk} % each. None: the most probable states until their scores add up to the guaranteed share, and "
        "one threshold set in training, or 0.5. By sample: guaranteed if samples are exchangeable; by family: if "
        f"families are. A set of {len(STATES)} states, or an alarm that is never sure, states nothing.",
        "Families: smallest number of calibration families of a tested one. n: tested samples without borderline "
        f"ones, of {int(pooled['clusters'].max())} families. {sheet.over()}.",
    )
    caption = "Sets of states that hold the true one, and an alarm with bounded errors, on families of shapes that "
    return sheet.table(caption + "nothing was trained or calibrated on" + run.stand_ins(), "metric", notes)


@table(
    SECTION,
    "Table XIX where calibrated and tested samples differ",
    """The same measures on each dataset; calibrated on one dataset and tested on the others; on samples of less or more
    severity than are tested; and on simulated pairs for depth frames. No guarantee covers these.""",
    **INPUT,
)
def table19_shift(run: Run, measured):
    titles = run.source_titles
    others = {f"from_{name}": f"{title} alone" for name, title in titles.items()}
    shifts = {"milder": "The milder half", "harder": "The harder half", "frames": "Simulated pairs"}
    measured = measured[(measured["source"] != REAL_WORLD) | (measured["samples"] >= FEWEST_FAILURES)]
    rows = []
    for condition, explainer in product({FAMILIES: "Other families", **others, **shifts}.items(), _titles(run).items()):
        entries, sources = {"condition": condition[0], "method": explainer[0]}, titles
        if condition[0] != FAMILIES:
            every = {POOLED: "All others" if condition[0] in others else "All together"}
            pooled = (where(measured, entries)["source"] == POOLED).any()
            sources = (every if pooled else titles) | {REAL_WORLD: "Depth frames"}
        rows += [Row([condition, source, explainer], {**entries, "source": source[0]}) for source in sources.items()]
    heads = {"calibrated_on": "Calibrated on", "source": "Tested on", "explainer": "Explainer"}
    sheet = Sheet("table19_shift", heads, rows, COLUMNS_OF_SHIFT, _with_counts(measured))
    level, missed, false_alarms = (f"{100 * run.config[NAME][name]:g}" for name in ("level", "missed", "false_alarms"))
    notes = (
        f"The limits are those of Table XIX, by sample: {level} % coverage, at most {missed} % missed failures and "
        f"{false_alarms} % false alarms; nothing guarantees them here. Each state: limits for each state by itself.",
        "Halves: by the largest severity, nominal and failed samples separately. All starts of an instance in depth "
        f"frames have the weight of one sample, intervals are over scenes, and fewer than {FEWEST_FAILURES} samples "
        "of a kind are not shown.",
    )
    caption = "Guarantees for causes on single datasets, and where calibrated and tested samples differ"
    return sheet.table(caption + run.stand_ins(), "metric", notes)


@figure(
    SECTION,
    "Guaranteed and measured",
    """Coverage and size of the sets, and both risks of the alarm, of Table XIX, with 95 % intervals. Lines mark what is
    guaranteed, the dashed one for families.""",
    **INPUT,
)
def guarantee(run: Run, measured):
    from matplotlib.lines import Line2D

    looks = {  # variant -> label, color, marker, distance below the middle of the row
        asked_for.PLAIN: ("not calibrated", VERMILION, "x", -0.35),
        asked_for.BY_SAMPLE: ("by sample", BLUE, "o", -0.35 / 3),
        asked_for.BY_STATE: ("by sample, each state", PURPLE, "s", 0.35 / 3),
        asked_for.BY_FAMILY: ("by family", GREEN, "^", 0.35),
    }
    shown = {  # metric -> label, and what is guaranteed: of samples, of families
        COVERAGE: ("sets that hold\nthe state (%)", ["level"]),
        SIZE: ("states in a set", []),
        MISSED: ("failed called\ngood (%)", ["missed", "family_risk"]),
        FALSE_ALARMS: ("good called\nfailed (%)", ["false_alarms", "family_risk"]),
    }
    rows = _of_all_sources(where(measured, {"condition": FAMILIES, "concept": ALL}))
    titles = {name: title for name, title in _titles(run).items() if (rows["method"] == name).any()}
    page, grid = panels(2, 2, 2.1 + 0.68 * len(titles), COLUMN_WIDTH_IN, sharey=True)
    for panel, (metric, (label, limits)) in zip(grid.flat, shown.items(), strict=True):
        scale = 100 if metric in SHARES else 1
        for variant, (_, color, marker, offset) in looks.items():
            points = where(rows, {"metric": metric, "variant": variant}).set_index("method")
            for y, name in enumerate(titles):
                if name in points.index:
                    low, value, high = scale * points.loc[name, ["low", "value", "high"]].to_numpy(float)
                    panel.plot([low, high], [y + offset] * 2, color=color, linewidth=0.8)
                    panel.plot(value, y + offset, marker, color=color, markersize=3)
        for limit, dashes in zip(limits, ("-", "--"), strict=False):
            panel.axvline(100 * run.config[NAME][limit], color=GRAY, linewidth=0.8, linestyle=dashes, zorder=0)
        panel.set_xlabel(label, fontsize=SMALL_PT)
        panel.tick_params(labelsize=SMALL_PT)
        if metric == SIZE:
            panel.set_xlim(0.8, len(STATES) + 0.2)
            panel.set_xticks(range(1, len(STATES) + 1))
        else:
            panel.set_xlim((None, 101) if metric == COVERAGE else (-1, None))
    grid[0, 0].set_yticks(range(len(titles)), [in_lines(title, 18) for title in titles.values()])
    grid[0, 0].set_ylim(len(titles) - 0.45, -0.55)
    handles = [
        Line2D([], [], color=color, marker=marker, markersize=3, linewidth=0.8, label=label)
        for label, color, marker, _ in looks.values()
    ]
    handles.append(Line2D([], [], color=GRAY, linewidth=0.8, label="promised (dashed: by family)"))
    legend_below(page, handles, columns=2, fontsize=SMALL_PT)
    return page


def _with_counts(measured: Frame) -> Frame:
    """The rows, and further ones for numbers of samples and of families, and for the state with the least coverage."""
    import pandas as pd

    whole_N = measured["concept"] == ALL
    states = measured[(measured["metric"] == COVERAGE) & ~whole_N]
    worst = states.loc[states.groupby(list(ROWS))["value"].idxmin()].assign(metric=WORST, concept=ALL)
    most = measured[whole_N].groupby(list(ROWS), as_index=False)[["families", "samples", "seeds"]].max()
    counts = [most.assign(metric=name, concept=ALL, value=most[name]) for name in ("families", "samples")]
    return pd.concat([measured, worst, *counts])


def _of_all_sources(rows: Frame) -> Frame:
    """Rows of all sources together, or of the only one."""
    return where(rows, {"source": POOLED if (rows["source"] == POOLED).any() else rows["source"].iloc[:1].sum()})


def _titles(run: Run) -> dict[str, str]:
    return run.titles(lambda name: explainer_entry(name, CAUSES), run.config[NAME]["explainers"])
