"""Makes the tables of gradients: the effect of deleting salient points, and TCAV's scores with their tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from gpca.experiments.gradients.metrics import SALIENCY, TCAV, percent
from gpca.objects.entry import title_of
from gpca.reporting.tables.builder import TableBuilder, crossed, mean_over, titles_of
from gpca.reporting.tables.cells import cell_of_repeats, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

ORDERS = {
    "gradient": "Most salient first",
    "to_centre": "Most salient first (to the center)",
    "random": "At random",
    "least_gradient": "Least salient first",
}


def saliency_deletion(metrics: pd.DataFrame, sources: Mapping[str, Mapping], conditions: Mapping) -> Table:
    """Return the fall of the named concept's score by order and share of deleted points, datasets × orders."""
    of_table = rows_where(metrics, table=SALIENCY)
    table = TableBuilder("saliency_deletion", {"source": "Dataset", "order": "Deleted"})
    columns: dict[str, Column] = {}
    for share in conditions["deleted"]:
        words = f"{percent(share)} %"
        columns[f"drop_{percent(share)}"] = Column(f"Fall without {words} (points)", limits=(-100, 100))
        columns[f"excess_{percent(share)}"] = Column(
            f"beyond random, {words}", limits=(-100, 100), beside=f"drop_{percent(share)}"
        )
        columns[f"changed_{percent(share)}"] = Column(f"Named otherwise (%), {words}", interval=False)
    for (source, order), labels in crossed(titles_of(sources), ORDERS):
        rows = rows_where(of_table, source=source, method=order)
        samples = int(rows_where(rows, metric="test_samples")["value"].sum())
        cells = {name: cell_of_repeats(100 * rows_where(rows, metric=name)["value"], samples) for name in columns}
        table.add_row(labels, cells)
    return table.build(
        caption="Fall of GP-CA's score without some of the points" + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns=columns,
        footnotes=(
            f"{mean_over(table.most_seeds(), conditions['samples'])}; one draw of points of each sample.",
            "Fall: of the score of the concept named on the whole draw, in hundredths; in brackets the excess over "
            "random deletion. To the center: in the order of how much moving a point to the center changes the score "
            "(Zheng et al. 2019). At random: mean of four orders.",
        ),
    )


def tcav(metrics: pd.DataFrame, sources: Mapping[str, Mapping], conditions: Mapping) -> Table:
    """Return TCAV's score of every concept for every class, and in how many seeds it differs from chance."""
    of_table = rows_where(metrics, table=TCAV)
    classes = list(dict.fromkeys(of_table["concept"]))
    table = TableBuilder("tcav", {"source": "Dataset", "tested": "Concept"})
    columns: dict[str, Column] = {}
    for name in classes:
        columns[f"score_{name}"] = Column(f"Class {name} (%)", of_samples=False)
        columns[f"significant_{name}"] = Column(f"seeds, {name}", decimals=0, interval=False)
    columns["probe"] = Column("Probes right (%)")
    for source, entry in sources.items():
        for tested in dict.fromkeys(of_table["method"]):
            rows = rows_where(of_table, source=source, method=tested)
            cells: dict[str, Cell | None] = {}
            for name in classes:
                of_class = rows_where(rows, concept=name)
                significant_R = rows_where(of_class, metric="significant")["value"]
                cells[f"score_{name}"] = cell_of_repeats(100 * rows_where(of_class, metric="score")["value"], 0)
                if len(significant_R):
                    cells[f"significant_{name}"] = Cell(float(significant_R.sum()), 0.0, len(significant_R), 0)
            probe_R = rows_where(rows, metric="probe").groupby("seed")["value"].mean()
            cells["probe"] = cell_of_repeats(100 * probe_R, 0)
            table.add_row([(source, title_of(entry)), (tested, tested)], cells)
    return table.build(
        caption="TCAV's scores for GP-CA" + table.stand_in_clause(sources, partly=False),
        column_head="quantity",
        columns=columns,
        footnotes=(
            f"Means over {plural(table.most_seeds(), 'seed')}; {conditions['vectors']} probes for each concept.",
            "Score: share of the test samples of the class whose log odds of it grow along the concept; about half "
            "if there is no relation. Seeds: in how many of them it differs from the scores of random probes, at the "
            f"level {conditions['level']:g} over all tests of a seed (Bonferroni). Probes right: accuracy on training "
            "samples that the probe did not learn, the mean of those with and without the concept.",
        ),
    )
