"""Makes the table of the joint reading: what one consistent protocol reproduces, and what no reading does."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.experiments.joint_reading.tally import DEVELOPMENT, EVALUATED, EVALUATION, JUDGED
from gpca.experiments.specification_curve.tables import Plain
from gpca.experiments.specification_curve.words import words_of
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell, rows_where
from gpca.reporting.tables.table import Table

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {"published": "Paper", "reproduced": "Protocol", "joint": "Joint reading"}
_YES, _NO = "yes", "no"
_KNOBS = {"low": "knobs at the lower ends", "middle": "knobs at the middles", "high": "knobs at the upper ends"}


def table16_joint_reading(
    verdicts: pd.DataFrame,
    scores: pd.DataFrame,
    choice: pd.DataFrame,
    development: str,
    sources: Mapping[str, Mapping],
) -> Table:
    """Return a row per printed mean of Tables I to V, each value of ours once.

    Args:
        verdicts: as :func:`gpca.experiments.joint_reading.judgement.read_verdicts` reads them.
        scores: tidy rows of ``joint_scores.csv``.
        choice: `choice` and `value` of the joint reading.
        development: title of the development objects.
        sources: those that are compared.
    """
    heads = {"number": "Number", "unit": "Unit", "close": "Protocol close", "joint_close": "Joint reading close"}
    table = TableBuilder("table16_joint_reading", heads | {"readings": "Other readings that are close"})
    for row in verdicts.itertuples():
        key = (row.table, row.row, row.column)
        count = f"{row.readings_close:.0f} of {row.readings:.0f}" if row.readings else "none was run"
        labels = (
            (" / ".join(key), ", ".join(key)),
            (row.unit, row.unit),
            *((_YES if flag else _NO,) * 2 for flag in (row.close, row.joint_close)),
            (f"{row.readings_close:.0f}/{row.readings:.0f}", count),
        )
        cells = {
            name: None if math.isnan(value) else plain_cell(value, int(row.n), 0)
            for name, value in ((name, float(getattr(row, name))) for name in COLUMNS)
        }
        table.add_row(labels, cells)
    never = ~(verdicts["close"] | verdicts["joint_close"] | (verdicts["readings_close"] > 0))
    return table.build(
        "The paper's Tables I to V under one reading of all that they leave open" + stand_in_clause(sources.values()),
        "value",
        {name: Plain(title, interval=False, limits=(-math.inf, math.inf)) for name, title in COLUMNS.items()},
        (
            f"The joint reading: {_in_words(choice)}. It was found on {development}; the paper states none.",
            _score(scores, DEVELOPMENT, EVALUATED, "There, of what is printed of the source that they stand for"),
            _ties(scores),
            _score(scores, EVALUATION, EVALUATED, "Here"),
            _score(scores, EVALUATION, JUDGED, "The protocol that is judged"),
            f"No reading of ours, alone or joint, comes close to {int(never.sum())} of the {len(verdicts)} numbers.",
            "Close: the mean is within the second tolerance (docs/comparison.md), whatever its interval. Of a range, "
            "Paper is the lower end. Values are in the row's unit.",
        ),
    )


def _in_words(choice: pd.DataFrame) -> str:
    of = dict(zip(choice["choice"], choice["value"], strict=True))
    severities = {"protocol": "the protocol's perturbations"}.get(of["severities"], f"{of['severities']} perturbations")
    named = [words_of(name, value) for name, value in of.items() if name not in ("severities", "knobs")]
    return ", ".join([severities, *named, _KNOBS[of["knobs"]]])


def _score(scores: pd.DataFrame, samples: str, method: str, subject: str) -> str:
    """Return a sentence with the close numbers, their share, and what chance gives."""
    rows = rows_where(scores, source=samples, method=method, table="all")
    of = dict(zip(rows["metric"], rows["value"], strict=True))
    largest = "the largest share would be" if samples == DEVELOPMENT else "it would be"
    return (
        f"{subject}: {of['close']:.0f} of {of['numbers']:.0f} numbers are close, {100 * of['share']:.0f} % with each "
        f"table weighted once; {largest} {100 * of['expected_unit']:.0f} % if printed numbers changed places within "
        f"the unit of a table (p = {of['p_unit']:.2f}), {100 * of['expected_column']:.0f} % within its columns "
        f"(p = {of['p_column']:.2f})."
    )


def _ties(scores: pd.DataFrame) -> str:
    rows = rows_where(scores, source=DEVELOPMENT, method=EVALUATED, table="all")
    of = dict(zip(rows["metric"], rows["value"], strict=True))
    return (
        f"Of {of['readings']:.0f} readings, {of['equals']:.0f} have that share there, and the first of them is taken; "
        f"the protocol's own has {100 * of['share_of_protocol']:.0f} %."
    )
