"""Makes the table of the estimators of a pose's covariance."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.experiments.estimators.covariances import REFERENCE
from gpca.objects.title import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder, interval_over
from gpca.reporting.tables.cells import cell_over_sources
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = {  # Each of these metrics has a column, and a factor to the column's unit.
    "kl_rotation": (Column("KL, rotation (nats)", 2, limits=(0, inf), least_is_best=True, heavy_tail=True), 1),
    "kl_translation": (Column("KL, translation (nats)", 2, limits=(0, inf), least_is_best=True, heavy_tail=True), 1),
    "nne": (Column("NNE", 2, interval=False, limits=(0, inf)), 1),
    "nees": (Column("NEES / 6", 1, interval=False, limits=(0, inf)), 1),
    "coverage": (Column("Coverage (%)"), 100),
    "auroc_failed": (Column("AUROC of failed", 3, limits=(0, 1)), 1),
    "spearman_error": (Column("Spearman with the error", 2, limits=(-1, 1)), 1),
    "no_estimate": (Column("None (%)", interval=False), 100),
}
_MILLISECONDS = Column("ms", interval=False, limits=(0, inf))
_RANKED = ("kl_rotation", "kl_translation", "auroc_failed", "spearman_error")


def table12_uncertainty(
    metrics: pd.DataFrame,
    seconds: pd.DataFrame,
    sources: Mapping[str, Mapping],
    estimators: Mapping[str, str],
    methods: Mapping[str, str],
    pairs: Mapping,
) -> Table:
    """Return how near each estimator is to the reference and how well it predicts the error: methods × estimators.

    Args:
        metrics: The tidy metrics that :func:`gpca.experiments.estimators.calibration.collect_estimates` makes.
        seconds: The tidy seconds beside them.
        pairs: The config's section ``estimator_pairs``.
    """
    table = TableBuilder("table12_uncertainty", {"method": "Registered by", "estimator": "Estimator"})
    without: list[str] = []
    rows = {REFERENCE: f"Reference, {pairs['starts']} starts", **estimators}
    for method, method_title in methods.items():
        for name, title in rows.items():
            cells = {
                key: cell_over_sources(metrics, metrics, sources, name, key, method, factor)
                for key, (_, factor) in _SHOWN.items()
                if not (name == REFERENCE and key.startswith("kl_"))  # of itself from itself
            }
            refused = cells["no_estimate"] and not any(cell for key, cell in cells.items() if key != "no_estimate")
            if refused:
                without.append(f"{title}, of {method_title}")
                continue
            cells["milliseconds"] = cell_over_sources(metrics, seconds, sources, name, "seconds", method, 1e3)
            table.add_row([(method, method_title), (name, title)], cells, rival=name != REFERENCE)
    table.compare_down(_RANKED, same=1)
    numbers = {
        method: cell_over_sources(metrics, metrics, sources, REFERENCE, "no_estimate", method, 1) for method in methods
    }
    counted = "; ".join(
        f"{cell.test_samples // cell.seeds} by {methods[name]}" for name, cell in numbers.items() if cell is not None
    )
    seeds = table.most_seeds()
    return table.build(
        caption="What estimators say of the covariance of a pose" + stand_in_clause(sources.values()),
        column_head="metric",
        columns={key: column for key, (column, _) in _SHOWN.items()} | {"milliseconds": _MILLISECONDS},
        footnotes=(
            f"Mean over {plural(seeds, 'seed')}; {interval_over(seeds)}. ± is left out where it exceeds the value, as "
            f"single seeds dominate such a mean; the CSV holds it. Registrations of each seed: {counted}.",
            f"KL: from the reference, Monte-Carlo with {pairs['starts']} starts; trimmed means (10 to 90 %), as NNE, "
            "NEES. NNE and NEES / 6 are near 1 and the coverage is 95 % if the covariance is that of the errors; above "
            "1, or below 95 %, an estimator is overconfident. Spread and error are those of the object's points. Bold: "
            "best of a method, the reference apart.",
            "None: refused, or failed for a reason that the files name. ms: of one estimate, with descriptors and "
            "normals, without learning; the one column that differs from run to run.",
            *([f"Left out, as they refuse every registration: {'; '.join(without)}."] if without else []),
        ),
    )
