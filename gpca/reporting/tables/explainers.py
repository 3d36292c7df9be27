"""The paper's tables, from tidy metrics: each function selects and labels, :class:`Table` writes.

All take the same arguments and raise the same error:

    metrics: tidy, as :mod:`gpca.attribution.metrics` collects them.
    sources: name -> ``{"title": str, "stand_in": bool}``, in the order of the rows.
    explainers: name -> ``{"title": str, "oracle": bool}``, in the order in which they are shown.
    InputError: the metrics hold none of these sources and explainers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.attribution.metrics import ALL, mean_interval
from gpca.errors import InputError
from gpca.objects.title import STAND_IN, title_of
from gpca.reporting.tables.table import EMPTY, Cell, Cells, Column, Rows, Table

if TYPE_CHECKING:
    import pandas as pd

GPCA_FORMS = ("gpca_paper", "gpca")  # whose concepts the paper's Table II looks into
TABLE1 = (
    "shap_additive",
    "sa_local_additive",
    *GPCA_FORMS,
)  # the paper's Table I: SHAP, SA, GP-CA, and ours trained longer
EXTENDED = {  # metric -> its column in table1_extended
    "accuracy": Column("Accuracy (%)"),
    "permuted_accuracy": Column("Relabelled (%)"),
    "causal_accuracy": Column("Causal (%)"),
    "causal_samples": Column("n causal", decimals=0, interval=False, limits=(0, inf)),
    "abstention_rate": Column("Abstained (%)", interval=False),
    "icp_calls": Column("ICP calls", decimals=0, interval=False, limits=(0, inf)),
    "seconds_per_sample": Column("Seconds", decimals=3, interval=False, limits=(0, inf)),
    "test_samples": Column("n", decimals=0, interval=False, limits=(0, inf)),
}
_SHARES = ("accuracy", "permuted_accuracy", "causal_accuracy", "abstention_rate")  # metrics in [0, 1], printed in %


def table1_single_baselines(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, Mapping]
) -> Table:
    """Accuracy of single-concept attribution (paper, Table I): sources by those of `TABLE1` with predictions."""
    shown = [name for name in TABLE1 if name in explainers and (metrics["method"] == name).any()]
    rows: Rows = []
    cells: Cells = {}
    for source, entry in sources.items():
        of_row = {name: cell for name in shown if (cell := _cell(metrics, source, name))}
        cells |= {(len(rows), name): cell for name, cell in of_row.items()}
        rows += [((source, title_of(entry)),)] if of_row else []
    return _table(
        metrics,
        sources,
        shown,
        name="table1_single_baselines",
        caption="Mean accuracy of single-concept attribution (%)",
        row_heads={"source": "Dataset"},
        rows=tuple(rows),
        column_head="explainer",
        columns={name: Column(explainers[name]["title"]) for name in shown},
        cells=cells,
        compared=tuple([(row, name) for name in shown] for row in range(len(rows))),
        notes=(*_different_samples(metrics, explainers, shown), "Abstained samples count as wrong."),
    )


def table1_extended(metrics: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, Mapping]) -> Table:
    """Every explainer on every source by the metrics of `EXTENDED`; one that was not measured has no column.

    The best accuracy of a source is bold, oracles apart: they are told what the others have to find out.
    """
    rows: Rows = []
    cells: Cells = {}
    compared: list[list[tuple[int, str]]] = []
    for source, source_entry in sources.items():
        rivals = []
        for explainer, entry in explainers.items():
            of_row = {metric: cell for metric in EXTENDED if (cell := _cell(metrics, source, explainer, metric=metric))}
            cells |= {(len(rows), metric): cell for metric, cell in of_row.items()}
            rivals += [(len(rows), "accuracy")] if of_row and not entry["oracle"] else []
            rows += [((source, title_of(source_entry)), (explainer, entry["title"]))] if of_row else []
        compared.append(rivals)
    measured = {metric for _, metric in cells}
    has_oracle = any(entry["oracle"] for entry in explainers.values())
    notes = {
        "accuracy": f"Bold: best accuracy on the dataset{', oracles apart' * has_oracle}. Abstained samples are wrong.",
        "permuted_accuracy": (
            "Relabelled: accuracy under the best one-to-one renaming of the predicted concepts, which takes the truth "
            "to find; where it is far above the accuracy, concepts are told apart but named wrongly."
        ),
        "causal_accuracy": (
            "Causal: accuracy on the n causal samples whose uncertainty lies above the 95th percentile of the clean "
            "ones of their dataset and seed."
        ),
        "icp_calls": "ICP calls: ICP runs per sample beyond the observed registration.",
        "seconds_per_sample": (
            "Seconds: all that one sample takes, the observed registration included; "
            "the one column that differs from run to run."
        ),
        "test_samples": "n: test samples of a seed.",
    }
    return _table(
        metrics,
        sources,
        explainers,
        name="table1_extended",
        caption="Single-concept attribution by every explainer",
        row_heads={"source": "Dataset", "explainer": "Explainer"},
        rows=tuple(rows),
        column_head="metric",
        columns={metric: column for metric, column in EXTENDED.items() if metric in measured},
        cells=cells,
        compared=tuple(compared),
        notes=tuple(note for metric, note in notes.items() if metric in measured),
    )


def table2_per_concept(
    metrics: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, Mapping]
) -> Table:
    """Accuracy per concept (paper, Table II): sources × those of `GPCA_FORMS` with predictions, by concepts and all.

    The best concept of a row is bold, as in the paper.
    """
    concepts = [concept for concept in metrics["concept"].unique() if concept != ALL]
    shown = {name: entry for name, entry in explainers.items() if name in GPCA_FORMS}
    rows: Rows = []
    cells: Cells = {}
    for source, source_entry in sources.items():
        for explainer, entry in shown.items():
            of_row = {c: cell for c in (*concepts, ALL) if (cell := _cell(metrics, source, explainer, c))}
            cells |= {(len(rows), concept): cell for concept, cell in of_row.items()}
            rows += [((source, title_of(source_entry)), (explainer, entry["title"]))] if of_row else []
    return _table(
        metrics,
        sources,
        shown,
        name="table2_per_concept",
        caption="Mean accuracy per concept (%)",
        row_heads={"source": "Dataset", "explainer": "Explainer"},
        rows=tuple(rows),
        column_head="concept",
        columns={concept: Column(concept.capitalize()) for concept in (*concepts, ALL)},
        cells=cells,
        compared=tuple([(row, concept) for concept in concepts] for row in range(len(rows))),
        notes=("Of the test samples that truly are of a concept, the share that is attributed to it.",),
    )


TABLES = {table.__name__: table for table in (table1_single_baselines, table1_extended, table2_per_concept)}


def _cell(
    metrics: pd.DataFrame, source: str, explainer: str, concept: str = ALL, metric: str = "accuracy"
) -> Cell | None:
    of_cell = metrics[
        (metrics["source"] == source) & (metrics["method"] == explainer) & (metrics["concept"] == concept)
    ]
    values_R = of_cell.loc[of_cell["metric"] == metric, "value"].to_numpy() * (100 if metric in _SHARES else 1)
    if len(values_R) == 0:
        return None
    mean, low, _ = mean_interval(values_R)
    counted = "causal_samples" if metric.startswith("causal") else "test_samples"
    samples = int(of_cell.loc[of_cell["metric"] == counted, "value"].sum())
    return Cell(mean, mean - low, len(values_R), samples)


def _table(metrics, sources, explainers: Iterable[str], *, caption: str, notes: tuple[str, ...], **fields) -> Table:
    """Make a table and say what is said the same way in all of them: the objects, the repeats, what ± means."""
    if not fields["cells"]:
        raise InputError("metrics", f"hold no accuracy for {fields['name']}", "run its explainers first")
    of_rows = {labels[0][0] for labels in fields["rows"]}
    stand_ins = [bool(sources[source]["stand_in"]) for source in of_rows]
    if any(stand_ins):
        caption += f", {'' if all(stand_ins) else 'partly '}on {STAND_IN}s of the datasets' objects"
    of_test = _test_samples(metrics, explainers)
    samples = _span(of_test.loc[of_test["source"].isin(of_rows), "value"])
    seeds = _span(cell.seeds for cell in fields["cells"].values())
    repeats = (
        f"Mean over {seeds} seed{'s' * (seeds != '1')}, {samples} test samples each; "
        f"± is the half-width of the 95 % t-interval over the seeds{f' ({EMPTY}: one seed)' * (seeds == '1')}."
    )
    return Table(caption=caption, footnotes=(repeats, *notes), **fields)


def _different_samples(metrics: pd.DataFrame, explainers: Mapping[str, Mapping], shown: Iterable[str]) -> list[str]:
    """Say who explains how many test samples, where not all explain as many."""
    of_test = _test_samples(metrics, shown)
    names: dict[str, list[str]] = {}
    for explainer, values in of_test.groupby("method", sort=False)["value"]:
        names.setdefault(_span(values), []).append(explainers[explainer]["title"])
    told = "; ".join(f"{samples} by {', '.join(titles)}" for samples, titles in names.items())
    return [f"Test samples explained: {told}."] if len(names) > 1 else []


def _test_samples(metrics: pd.DataFrame, explainers: Iterable[str]) -> pd.DataFrame:
    return metrics[
        (metrics["metric"] == "test_samples") & (metrics["concept"] == ALL) & metrics["method"].isin(list(explainers))
    ]


def _span(numbers: Iterable[float]) -> str:
    distinct = sorted({int(number) for number in numbers})
    return str(distinct[0]) if len(distinct) == 1 else f"{distinct[0]} to {distinct[-1]}"
