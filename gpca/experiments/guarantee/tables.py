"""Makes Table XIX: what was promised about causes, and what was measured on families that nothing was set on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.frame_causes.tables import FEWEST_FAILURES
from gpca.experiments.guarantee.answers import BY_FAMILY, BY_SAMPLE, BY_STATE, CONFIDENT, FAMILIES, PLAIN
from gpca.experiments.guarantee.metrics import COVERAGE, FALSE_ALARMS, MISSED, SHARES, SINGLE, SIZE, UNSURE
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.guarantee import STATES
from gpca.objects.entry import title_of
from gpca.reporting.tables.builder import TableBuilder, crossed
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

VARIANTS = {
    PLAIN: "None: scores as they are",
    BY_SAMPLE: "By sample",
    BY_STATE: "By sample, each state",
    CONFIDENT: "By sample, with confidence",
    BY_FAMILY: "By family",
}
WORST = "worst_state"
SHOWN = {
    COVERAGE: Column("Coverage (%)"),
    WORST: Column("Of the worst state (%)"),
    SIZE: Column("States in a set", decimals=2, limits=(0.0, float(len(STATES))), least_is_best=True),
    SINGLE: Column("One state alone (%)", interval=False),
    MISSED: Column("Missed failures (%)", least_is_best=True),
    FALSE_ALARMS: Column("False alarms (%)", least_is_best=True),
    UNSURE: Column("Not sure (%)", least_is_best=True),
    "families": Column("Families", decimals=0, interval=False, limits=(0.0, inf)),
    "samples": Column("n", decimals=0, interval=False, limits=(0.0, inf)),
}
EACH = {COVERAGE: "each_state_coverage", SIZE: "each_state_set_size"}
SHIFT_COLUMNS = {
    **{name: SHOWN[name] for name in (COVERAGE, SIZE)},
    EACH[COVERAGE]: Column("Each state: coverage (%)"),
    EACH[SIZE]: replace(SHOWN[SIZE], title="Each state: states in a set"),
    **{name: SHOWN[name] for name in (MISSED, FALSE_ALARMS, UNSURE, "samples")},
}
SHIFTS = {"milder": "The milder half", "harder": "The harder half", "frames": "Simulated pairs"}


def table19_guarantee(
    measured: pd.DataFrame, explainers: Mapping[str, str], sources: Mapping[str, Mapping], promised: Mapping[str, Any]
) -> Table:
    """Return coverage and size of the sets and the risks of the alarm, by explainer and how it was calibrated.

    Args:
        measured: What :func:`gpca.experiments.guarantee.metrics.read_guarantee` returned.
        promised: The settings of :class:`gpca.experiments.guarantee.settings.GuaranteeSettings`.
    """
    table = TableBuilder("table19_guarantee", {"explainer": "Explainer", "calibrated": "Calibrated"})
    of_families = rows_where(measured, condition=FAMILIES)
    pooled = of_families[of_families["source"] == _place_of_all(of_families)]
    for (explainer, variant), labels in crossed(explainers, VARIANTS):
        rows = rows_where(pooled, method=explainer, variant=variant)
        table.add_row(labels, _cells(rows, SHOWN))
    return table.build(
        caption="Sets of states that hold the true one, and an alarm with bounded errors, on families of shapes that "
        "nothing was learned from or calibrated on" + _stand_ins(sources),
        column_head="metric",
        columns=SHOWN,
        footnotes=(
            f"Promised: sets that hold the state in {_percent(promised['level'])} % of the cases (Coverage); at most "
            f"{_percent(promised['missed'])} % of the failed called good (Missed failures) and "
            f"{_percent(promised['false_alarms'])} % of the nominal called failed (False alarms), by family "
            f"{_percent(promised['family_risk'])} % each. With confidence: the two risks hold for these very "
            f"thresholds, in {_percent(promised['confidence'])} % of the draws of the samples that they were set on.",
            "States: nominal, one cause, or several. None: the most probable states until their scores add up to what "
            "is promised, and one threshold that misses as many of the failed in training as is promised, or 0.5 where "
            "nothing is learned. By sample: "
            "the promise holds if single samples are exchangeable. By family: if families are. A set of "
            f"{len(STATES)} states, or an alarm that is not sure of anything, says nothing.",
            "Families: that each tested one is calibrated on, at least. n: tested samples without borderline ones, of "
            f"{int(pooled['clusters'].max())} families and {plural(int(pooled['seeds'].max()), 'seed')}. In brackets: "
            f"the 95 % interval of a bootstrap over families and seeds ({REPEATS} draws).",
        ),
    )


def table19_shift(
    measured: pd.DataFrame, explainers: Mapping[str, str], sources: Mapping[str, Mapping], promised: Mapping[str, Any]
) -> Table:
    """Return the same for each source, and where other samples were calibrated on than are tested."""
    heads = {"calibrated_on": "Calibrated on", "source": "Tested on", "explainer": "Explainer"}
    table = TableBuilder("table19_shift", heads)
    titles = {name: title_of(entry) for name, entry in sources.items()}
    others = {f"from_{name}": f"{title} alone" for name, title in titles.items()}
    conditions = {FAMILIES: "Other families", **others, **SHIFTS}
    for (condition, explainer), labels in crossed(conditions, explainers):
        rows = rows_where(measured, condition=condition, method=explainer)
        places = {POOLED: "All others" if condition in others else "All together", **titles, REAL_WORLD: "Depth frames"}
        if condition == FAMILIES:
            places = titles
        elif (rows["source"] == POOLED).any():
            places = {POOLED: places[POOLED]}
        for place in places.items():
            of_place = rows_where(rows, source=place[0])
            if place[0] == REAL_WORLD:
                of_place = of_place[of_place["samples"] >= FEWEST_FAILURES]
            table.add_row([labels[0], place, labels[1]], _shift_cells(of_place))
    return table.build(
        caption="Promises about causes on single datasets, and where calibrated and tested samples differ"
        + _stand_ins(sources),
        column_head="metric",
        columns=SHIFT_COLUMNS,
        footnotes=(
            f"Promised as in Table XIX, by sample: {_percent(promised['level'])} % coverage, at most "
            f"{_percent(promised['missed'])} % missed failures and {_percent(promised['false_alarms'])} % false "
            "alarms. The promise is for new families of all datasets together. Nothing promises that it holds here: "
            "the numbers are what is left of it.",
            "Each state: limits for each state by itself. Severity: the largest of the severities of noise, rotation, "
            "translation and crop, as shares of the most in any sample; nominal and failed samples are halved by "
            "themselves. Of depth frames an instance counts once, intervals are over scenes, and nothing is said of "
            f"fewer than {FEWEST_FAILURES} samples of a kind.",
        ),
    )


def _place_of_all(rows: pd.DataFrame) -> str:
    places = rows["source"].unique().tolist()
    return POOLED if POOLED in places or not places else places[0]


def _cells(rows: pd.DataFrame, shown: Mapping[str, Column]) -> dict[str, Cell | None]:
    of_all = rows_where(rows, concept=ALL).set_index("metric")
    cells: dict[str, Cell | None] = {
        name: interval_cell(of_all.loc[name], factor=100 if name in SHARES else 1)
        for name in shown
        if name in of_all.index
    }
    covered = rows[(rows["metric"] == COVERAGE) & (rows["concept"] != ALL)]
    if WORST in shown and len(covered):
        worst = covered.loc[covered["value"].idxmin()]
        cells[WORST] = interval_cell(worst)
    if len(of_all):
        samples, seeds = int(of_all["samples"].max()), int(of_all["seeds"].max())
        cells |= {
            name: plain_cell(of_all[name].max(), seeds, samples) for name in ("families", "samples") if name in shown
        }
    return cells


def _shift_cells(rows: pd.DataFrame) -> dict[str, Cell | None]:
    each = _cells(rows_where(rows, variant=BY_STATE), SHOWN)
    by_sample = _cells(rows_where(rows, variant=BY_SAMPLE), SHIFT_COLUMNS)
    return by_sample | {name: each.get(metric) for metric, name in EACH.items()}


def _percent(share: float) -> str:
    return f"{100 * share:g}"


def _stand_ins(sources: Mapping[str, Mapping]) -> str:
    return ", procedural stand-ins among them" if any(entry["stand_in"] for entry in sources.values()) else ""
