"""Makes the table of SHAP by a live function beside SHAP by a table of outcomes."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, Any

from gpca.reporting.tables.builder import TableBuilder, crossed, titles_of
from gpca.reporting.tables.cells import cell_of_repeats, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

_PLAIN: dict[str, Any] = {"interval": False, "limits": (0, inf)}
MEASURES = {  # Each measure has a column, and a factor to the column's unit.
    "largest_value": (Column("Largest value (nats)", decimals=3, **_PLAIN), 1),
    "largest_difference": (Column("Largest difference (10⁻⁹ nats)", decimals=3, **_PLAIN), 1e9),
    "named_alike": (Column("Named alike (%)", interval=False), 100),
    "live_icp_calls": (Column("ICP calls, live", decimals=0, **_PLAIN), 1),
    "icp_calls": (Column("ICP calls, table", decimals=0, **_PLAIN), 1),
    "test_samples": (Column("n", decimals=0, **_PLAIN), 1),
}


def live_shap(metrics: pd.DataFrame, sources: Mapping[str, Mapping]) -> Table:
    """Return how far the values of both ways lie apart, and what they cost: a row per source."""
    table = TableBuilder("live_shap", {"source": "Dataset"})
    for (source,), labels in crossed(titles_of(sources)):
        rows = rows_where(metrics, source=source)
        samples = int(rows_where(rows, metric="test_samples")["value"].sum())
        cells = {
            name: cell_of_repeats(rows_where(rows, metric=name)["value"].to_numpy() * factor, samples)
            for name, (_, factor) in MEASURES.items()
        }
        table.add_row(labels, cells)
    return table.build(
        caption="shap's KernelExplainer on a function that registers, and on a table of its outcomes"
        + table.stand_in_clause(sources),
        column_head="measure",
        columns={name: column for name, (column, _) in MEASURES.items()},
        footnotes=(
            f"Means over {plural(table.most_seeds(), 'seed')}; n: its samples.",
            "Largest value, largest difference: of the Shapley values of a seed's samples. ICP calls: runs for one "
            "sample; live, those of the reference are counted too.",
        ),
    )
