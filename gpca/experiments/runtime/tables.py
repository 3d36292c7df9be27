"""Makes Table VII of the paper: the time that each component takes, here and as printed."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, nan
from typing import TYPE_CHECKING

from gpca.comparison.published import HARDWARE, Number, printed_seconds
from gpca.errors import InputError
from gpca.model.runtime_file import COMPONENTS
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell
from gpca.reporting.tables.table import EMPTY, Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd


def table7_runtime(runtime: pd.DataFrame, title: str, numbers: Iterable[Number]) -> Table:
    """Return mean, standard deviation and median of each component in milliseconds, and the paper's numbers.

    Args:
        runtime: The frame that :func:`gpca.model.runtime_file.read_runtime` reads.
    """
    if runtime.empty:
        raise InputError("runtime", "has no rows", "run the step 'runtime' first")
    published = printed_seconds(numbers)
    table = TableBuilder(
        "table7_runtime", {"component": "Component", "device": "Device", "published_device": "Device (paper)"}
    )
    for row in runtime.itertuples():
        printed = published.get(row.component)
        published_on = printed.device if printed else ""
        cells = {
            name: plain_cell(1e3 * getattr(row, f"{name}_s"), 1, int(row.repeats))
            for name in ("mean", "deviation", "median")
        }
        if printed:
            cells["published"] = Cell(1e3 * printed.value, nan, 1, 100, at_least=printed.upper > printed.value)
        labels = [
            (row.component, COMPONENTS[row.component]),
            (row.device, row.device),
            (published_on, published_on or EMPTY),
        ]
        table.add_row(labels, cells)
    here = "; ".join(f"{row.device}: {row.hardware}" for row in runtime.drop_duplicates("device").itertuples())
    there = "; ".join(f"{device}: {hardware}" for device, hardware in HARDWARE.items())
    ranges = "".join(
        f"; {COMPONENTS[component]} takes {number.text()} {number.unit}"
        for component, number in published.items()
        if number.upper > number.value
    )
    threads = int(runtime["threads"].iloc[0])
    repeats = int(runtime["repeats"].iloc[0])

    def milliseconds(name: str, decimals: int = 2) -> Column:
        return Column(f"{name} (ms)", decimals=decimals, interval=False, limits=(0, inf), least_is_best=True)

    return table.build(
        caption=f"Runtime per component on {title}, and as the paper prints it",
        column_head="statistic",
        columns={
            "mean": milliseconds("Mean"),
            "deviation": milliseconds("Std. dev."),
            "median": milliseconds("Median"),
            "published": milliseconds("Paper", decimals=0),
        },
        footnotes=(
            f"Over {repeats} runs, {plural(threads, 'thread')}. Here {here}. Paper: {there}{ranges}.",
            "ICP from one initial pose, between clouds of up to as many points as in the protocol; feature extraction "
            "of all draws of one cloud; sampling and scores of one registration. BALD selection scores the whole pool "
            "and picks a batch; retraining learns that batch.",
            "One explanation is all that happens between two clouds and the scores, by the explainer of "
            "`python -m gpca explain`. 512 points: the encoder sees all of them, in one draw.",
        ),
    )
