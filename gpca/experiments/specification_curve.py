"""The printed numbers under every reading of the choices that the paper leaves unstated (Table XIII)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_args

import numpy as np

from gpca.comparison.readings import read_judged, summarize, unresolved
from gpca.declarations import Experiment, Figure, Frame, Names, Run, Tidy, figure, table
from gpca.errors import InputError
from gpca.experiments import reading_words
from gpca.experiments.frames import frames_of
from gpca.frames.source import REAL_WORLD, conditions_of
from gpca.objects.entry import stand_in_clause
from gpca.pairs.perturbation import Severities
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

    def values_of(group: str) -> Mapping[str, list]:
        return readings["groups"].get(group) or {}

    run = [name for name in readings["groups"] if readable.get(name, True)]
    return {
        "reading_group": run,
        "whole_group": [name for name in readings["groups"] if name != FRAME_REPEATS],
        "estimated": f"{REAL_WORLD}_{estimated[0]}" if estimated else "",
        "repeats": list(values_of(FRAME_REPEATS).get("repeats", [])),
        "repeated_backbone": list(frames["backbones"]),
    }


READ_ALL = "gpca.evaluation.measures:read_all_metrics"
EXPERIMENT = Experiment(
    name="specification_curve",
    beside=("reading_steps",),
    sections={"readings": Section},
    tidy=(Tidy("readings.csv", READ_ALL, {"paths": "readings/{reading_group}.csv"}, rule="reading_values"),),
    names=names,
    optional_entries={"readings.groups": Names("group of readings", lambda: GROUPS)},
)


@dataclass(frozen=True)
class Plain(Column):
    """Column of numbers with three digits, whatever their unit, e.g. ``0.592``."""

    def text(self, cell: Cell) -> str:  # noqa: D102
        return f"{cell.mean:.3g}"


def plain_column(title: str) -> Plain:
    return Plain(title, interval=False, limits=(-math.inf, math.inf))


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
    open (readings). "Produced": a reading is close. "Between": none is, but some lie below and some above. "Outside":
    the number lies beyond all readings. The choices were fixed before they were run, and no reading counts as the
    reproduction. Times are not included.""",
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
    return table.build(
        "The numbers that are not reproduced, under other readings of what the paper leaves unstated" + stand_ins(run),
        "value",
        {
            **{name: plain_column(title) for name, title in COLUMNS.items()},
            CHANCE: Column("Chance (%)", decimals=0, interval=False),
        },
        (
            "Chance: the share of the span of a group's values, from Least to Most, that is close to one of its "
            "readings: how likely a number from anywhere in it would be produced (docs/comparison.md). Of the "
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
    from gpca.reporting.figures.panels import panels
    from gpca.reporting.figures.style import BLUE, LIGHT_GRAY, SMALL_PT, write_title

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
