"""Makes Table IX by what a re-enactment knows of the truth."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import TYPE_CHECKING

from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis.tables import AGAIN, SHOWN
from gpca.experiments.reenactment.knowledge import KNOWN, in_words
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder, crossed, titles_of
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

SHARE_OF = {"auroc_failed": 1}  # the others are printed in %
COLUMNS = {
    "balanced_accuracy": SHOWN["balanced_accuracy"],
    "balanced_accuracy_gain": Column("Over the estimate (points)", limits=(-100.0, 100.0)),
    "dominant_accuracy": SHOWN["dominant_accuracy"],
    "dominant_accuracy_gain": Column("Over the estimate (points)", limits=(-100.0, 100.0)),
    "auroc_failed": SHOWN["auroc_failed"],
    "regret": SHOWN["regret"],
    "regret_gain": Column("Over the estimate (points)", limits=(-inf, inf)),
    "false_alarm_rate": SHOWN["false_alarm_rate"],
    "samples": SHOWN["samples"],
}


def table9_oracle(oracles: pd.DataFrame, sources: Mapping[str, Mapping]) -> Table:
    """Return what the untrained re-enactment would reach if it knew parts of the truth, pooled and by source.

    Args:
        oracles: What :func:`gpca.experiments.reenactment.metrics.collect_oracles` returned.
    """
    titles = {POOLED: "All together"} | titles_of(sources)
    table = TableBuilder("table9_oracle", {"source": "Dataset", "known": "Known"})
    for (source, known), labels in crossed(titles, {name: in_words(name) for name in KNOWN} | AGAIN):
        rows = rows_where(oracles, source=source, known=known).set_index("metric")
        cells = {}
        for metric, row in rows.iterrows():
            scale = SHARE_OF.get(metric, 100)
            cells[metric] = interval_cell(row, factor=scale)
            if f"{metric}_gain" in COLUMNS and isfinite(row["difference"]):
                names = ("difference", ("difference_low", "difference_high"))
                cells[f"{metric}_gain"] = interval_cell(row, *names, scale)
        if len(rows):
            judged = int(rows["samples"].max())
            cells["samples"] = plain_cell(judged, int(rows["seeds"].iloc[0]), judged)
        table.add_row(labels, cells)
    return table.build(
        caption="What a re-enactment would say if it knew parts of the truth" + stand_in_clause(sources.values()),
        column_head="metric",
        columns=COLUMNS,
        footnotes=(
            "Known: the hypothesis of the true pose is right; or each observed point is known without its noise, and "
            "how noisy it was; or the surface that was missing is known. The rest is estimated as ever, without any "
            "training. No observer knows any of this.",
            "n: test samples that are judged; borderline ones are left out. The measures are those of Table IX. Over "
            "the estimate: minus the first row of the dataset, on the same draws; regret is the better, the smaller. "
            f"Over {plural(table.most_seeds(), 'seed')}; in brackets the 95 % interval of a bootstrap over objects and "
            f"seeds ({REPEATS} draws).",
            "The last row is the truth measured again from other starts, on the whole surface of the object: the rows "
            "above know the model's points alone.",
        ),
    )
