"""Makes the part of Table IX on what each part of a registration is worth, and what it costs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.tables import NOT_COMPARED, SHOWN, cells_of
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder, crossed, titles_of
from gpca.reporting.tables.cells import rows_where
from gpca.reporting.tables.table import Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {
    "icp_calls": SHOWN["icp_calls"],
    **{key: SHOWN[key] for key in ("regret", "tied_accuracy", "balanced_accuracy")},
    "lead": replace(SHOWN["lead"], title="To the best other (points)"),
    **{key: SHOWN[key] for key in ("dominant_accuracy", "false_alarm_rate", "auroc_failed", "samples")},
}


def table9_features(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    costs: Mapping[str, Mapping],
) -> Table:
    """Return the measures of learners that see more and more, pooled and by source.

    Args:
        intervals: What :func:`gpca.experiments.diagnosis.metrics.collect_intervals` returned of their answers.
        costs: What each ``sees``, in words, and its number of ``icp_calls``.
    """
    titles = {POOLED: "All together"} | titles_of(sources)
    table = TableBuilder("table9_features", {"source": "Dataset", "explainer": "Learner and what it reads"})
    for (source, explainer), labels in crossed(titles, explainers):
        rows = rows_where(intervals, source=source, method=explainer).set_index("metric")
        table.add_row(labels, cells_of(rows, COLUMNS, "balanced_accuracy", costs[explainer]))
    table.compare_down([key for key in COLUMNS if key not in NOT_COMPARED], same=1)
    return table.build(
        caption="What each part of a registration tells of its causes" + stand_in_clause(sources.values()),
        column_head="metric",
        columns=COLUMNS,
        footnotes=(
            "ICP calls: runs beyond the one that is explained. Rows with as many compare what the same price buys. "
            "Aligned source: thickness, spacing, extent and number of points of the observed cloud. Remedies with few "
            "calls: those without a restart.",
            "To the best other: balanced accuracy minus that of the best other row of the dataset, on the same draws. "
            f"The measures are those of Table IX. Over {plural(table.most_seeds(), 'seed')}; in brackets the 95 % "
            f"interval of a bootstrap over objects and seeds ({REPEATS} draws). Bold: best of a dataset.",
        ),
    )
