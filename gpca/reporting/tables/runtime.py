"""Table VII of the paper: what each component takes, here and as printed."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, nan
from typing import TYPE_CHECKING

from gpca.comparison.published import HARDWARE, Number, printed_seconds
from gpca.errors import InputError
from gpca.model.runtime_file import COMPONENTS
from gpca.reporting.tables.table import Cell, Cells, Column, Rows, Table

if TYPE_CHECKING:
    import pandas as pd


def table7_runtime(runtime: pd.DataFrame, title: str, numbers: Iterable[Number]) -> Table:
    """Mean, standard deviation and median of each component in milliseconds, and what the paper prints.

    Args:
        runtime: as :func:`gpca.model.runtime_file.read_runtime` reads it.
        title: of the objects that were registered.
        numbers: that the paper prints.

    Raises:
        InputError: no rows.
    """
    if runtime.empty:
        raise InputError("runtime", "holds no rows", "run the step 'runtime' first")
    published = printed_seconds(numbers)
    rows: Rows = []
    cells: Cells = {}
    for row, of_row in enumerate(runtime.itertuples()):
        printed = published.get(of_row.component)
        published_on = printed.device if printed else ""
        repeats = int(of_row.repeats)
        rows.append(
            (
                (of_row.component, COMPONENTS[of_row.component]),
                (of_row.device, of_row.device),
                (published_on, published_on or "–"),
            )
        )
        for name in ("mean", "deviation", "median"):
            cells[row, name] = Cell(1e3 * getattr(of_row, f"{name}_s"), nan, 1, repeats)
        if printed:
            cells[row, "published"] = Cell(1e3 * printed.value, nan, 1, 100, printed.upper > printed.value)
    here = "; ".join(f"{row.device}: {row.hardware}" for row in runtime.drop_duplicates("device").itertuples())
    there = "; ".join(f"{device}: {hardware}" for device, hardware in HARDWARE.items())
    ranges = [
        f"{COMPONENTS[component]} takes {number.text()} {number.unit}"
        for component, number in published.items()
        if number.upper > number.value
    ]
    threads, repeats = int(runtime["threads"].iloc[0]), int(runtime["repeats"].iloc[0])

    def milliseconds(name: str, decimals: int = 2) -> Column:
        return Column(f"{name} (ms)", decimals=decimals, interval=False, limits=(0, inf), least_is_best=True)

    return Table(
        name="table7_runtime",
        caption=f"Runtime per component on {title}, and as the paper prints it",
        row_heads={"component": "Component", "device": "Device", "published_device": "Device (paper)"},
        rows=tuple(rows),
        column_head="statistic",
        columns={
            "mean": milliseconds("Mean"),
            "deviation": milliseconds("Std. dev."),
            "median": milliseconds("Median"),
            "published": milliseconds("Paper", decimals=0),
        },
        cells=cells,
        footnotes=(
            f"Over {repeats} runs, {threads} thread{'s' * (threads != 1)}. Here {here}. Paper: {there}"
            f"{''.join(f'; {text}' for text in ranges)}.",
            "ICP from one initial pose, between clouds of up to as many points as in the protocol; feature extraction "
            "of all draws of one cloud; sampling and scores of one registration. BALD selection scores the whole pool "
            "and picks a batch; retraining learns that batch.",
            "One explanation is all that happens between two clouds and the scores, by the explainer of "
            "`python -m gpca explain`. 512 points: the encoder sees all of them, in one draw.",
        ),
    )
