"""The paper's tables, from tidy metrics: each function selects and labels, :class:`Table` writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from gpca.errors import InputError
from gpca.metrics import ALL, mean_interval
from gpca.reporting.table import EMPTY, Cell, Table

if TYPE_CHECKING:
    import pandas as pd

STAND_IN = "procedural stand-in"
GPCA = ("gpca_paper", "gpca")  # whose concepts the paper's Table II looks into


def table1_single_baselines(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]
) -> Table:
    """Accuracy of single-concept attribution (paper, Table I): sources by those explainers that have predictions.

    Args:
        metrics: tidy, as :func:`gpca.metrics.collect` makes them.
        sources: name -> ``{"title": str, "stand_in": bool}``, in the order of the rows.
        explainers: name -> title, in the order of the columns.

    Raises:
        InputError: the metrics hold none of these sources and explainers.
    """
    shown = {name: title for name, title in explainers.items() if (metrics["method"] == name).any()}
    rows, cells = [], {}
    for source, entry in sources.items():
        of_row = {name: cell for name in shown if (cell := _accuracy_cell(metrics, source, name, ALL))}
        cells |= {(len(rows), name): cell for name, cell in of_row.items()}
        rows += [((source, title_of(entry)),)] if of_row else []
    return _accuracy_table(
        metrics,
        sources,
        name="table1_single_baselines",
        caption="Mean accuracy of single-concept attribution (%)",
        row_heads={"source": "Dataset"},
        rows=tuple(rows),
        column_head="explainer",
        columns=shown,
        cells=cells,
        notes=("Abstained samples count as wrong.",),
    )


def table2_per_concept(metrics: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]) -> Table:
    """Accuracy per concept (paper, Table II): sources × those of `GPCA` with predictions, by concepts and all.

    Arguments and errors as of :func:`table1_single_baselines`. The best concept of a row is bold, as in the paper.
    """
    concepts = [concept for concept in metrics["concept"].unique() if concept != ALL]
    columns = {concept: concept.capitalize() for concept in (*concepts, ALL)}
    rows, cells = [], {}
    for source, entry in sources.items():
        for explainer, title in ((name, title) for name, title in explainers.items() if name in GPCA):
            of_row = {c: cell for c in columns if (cell := _accuracy_cell(metrics, source, explainer, c))}
            cells |= {(len(rows), concept): cell for concept, cell in of_row.items()}
            rows += [((source, title_of(entry)), (explainer, title))] if of_row else []
    return _accuracy_table(
        metrics,
        sources,
        name="table2_per_concept",
        caption="Mean accuracy per concept (%)",
        row_heads={"source": "Dataset", "explainer": "Explainer"},
        rows=tuple(rows),
        column_head="concept",
        columns=columns,
        cells=cells,
        compared=tuple(concepts),
        notes=("Of the test samples that truly are of a concept, the share that is attributed to it.",),
    )


TABLES = {table.__name__: table for table in (table1_single_baselines, table2_per_concept)}


def _accuracy_cell(metrics: pd.DataFrame, source: str, explainer: str, concept: str) -> Cell | None:
    of_cell = metrics[
        (metrics["source"] == source) & (metrics["method"] == explainer) & (metrics["concept"] == concept)
    ]
    accuracies_R = 100 * of_cell.loc[of_cell["metric"] == "accuracy", "value"].to_numpy()
    if len(accuracies_R) == 0:
        return None
    mean, low, _ = mean_interval(accuracies_R)
    samples = int(of_cell.loc[of_cell["metric"] == "test_samples", "value"].sum())
    return Cell(mean, mean - low, len(accuracies_R), samples)


def _accuracy_table(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], *, caption: str, notes: tuple[str, ...], **fields
) -> Table:
    """Make a table and say what is said the same way in all of them: the objects, the repeats, what ± means."""
    if not fields["cells"]:
        raise InputError("metrics", f"hold no accuracy for {fields['name']}", "run its explainers first")
    shown = {labels[0][0] for labels in fields["rows"]}
    stand_ins = [bool(sources[source]["stand_in"]) for source in shown]
    if any(stand_ins):
        caption += f", {'' if all(stand_ins) else 'partly '}on {STAND_IN}s of the datasets' objects"
    of_test = metrics[(metrics["metric"] == "test_samples") & (metrics["concept"] == ALL)]
    samples = _span(of_test.loc[of_test["source"].isin(shown), "value"])
    seeds = _span(cell.seeds for cell in fields["cells"].values())
    repeats = (
        f"Mean over {seeds} seed{'s' * (seeds != '1')}, {samples} test samples each; "
        f"± is the half-width of the 95 % t-interval over the seeds{f' ({EMPTY}: one seed)' * (seeds == '1')}."
    )
    return Table(caption=caption, footnotes=(repeats, *notes), **fields)


def _span(numbers: Iterable[float]) -> str:
    distinct = sorted({int(number) for number in numbers})
    return str(distinct[0]) if len(distinct) == 1 else f"{distinct[0]} to {distinct[-1]}"


def title_of(entry: Mapping) -> str:
    """Return a source's title, with the words that it is a stand-in where it is one."""
    return f"{entry['title']} ({STAND_IN})" if entry["stand_in"] else entry["title"]
