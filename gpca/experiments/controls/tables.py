"""Makes Table X: every explainer with a shortcut closed, and its transfer from each source to each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING

from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.cause_tables import rule_near_chance
from gpca.experiments.controls.metrics import CALLS
from gpca.experiments.controls.settings import HARD, PAPER, TRANSFER, UNSEEN, WRONG_LABELS
from gpca.objects.entry import stand_in_clause
from gpca.reporting.tables.builder import TableBuilder, crossed, titles_of
from gpca.reporting.tables.cells import interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Cell, Column, Table
from gpca.reporting.words import plural, span

if TYPE_CHECKING:
    import pandas as pd

TITLES = {
    PAPER: "Paper's protocol (%)",
    "density": "Matched density",
    UNSEEN: "Unseen objects",
    HARD: "Hard",
    TRANSFER: "Other sources",
    "reversed": "ICP reversed",
    **{name: f"{100 * share:g} % wrong labels" for name, share in WRONG_LABELS.items()},
    "shuffled": "Shuffled labels",
}
CHANGE = "_change"  # behind a control's name: the key of the column of its differences
COMPARED = (PAPER, UNSEEN, HARD)  # with the best untrained explainer and the best rival, in columns of their own
DIFFERENCES = {"_gain": ("gain", "over untrained (points)"), "_lead": ("lead", "lead (points)")}
WRONG = "_wrong"  # behind the key of an AUROC: the column of the answers that it has to detect
BOOTSTRAP = f"the 95 % interval of a bootstrap over objects and seeds ({REPEATS} draws)"
ALL_TOGETHER = {POOLED: "All together"}


def table10_controls(
    intervals: pd.DataFrame,
    sources: Mapping[str, Mapping],
    explainers: Mapping[str, str],
    controls: Sequence[str],
    sees: Mapping[str, str],
) -> Table:
    """Return accuracy under every control with its change against the paper's protocol, pooled and by source.

    Args:
        intervals: What :func:`gpca.experiments.controls.metrics.collect_intervals` returned.
        controls: The names of those that were run.
        sees: What each explainer sees, in words.
    """
    table = TableBuilder("table10_controls", {"source": "Dataset", "explainer": "Explainer", "reads": "Reads"})
    names = [PAPER, *(name for name in TITLES if name in controls)]
    for (source, explainer), labels in crossed(ALL_TOGETHER | titles_of(sources), explainers):
        rows = rows_where(intervals, source=source, method=explainer)
        table.add_row([*labels, (sees[explainer], sees[explainer])], _cells(rows, source, names))
    table.compare_down([name for name in names if name != "shuffled"], same=1)
    columns = {name: Column(TITLES[name], interval=False) for name in names}
    columns |= {
        name + CHANGE: Column(f"{TITLES[name]}: change", limits=(-100.0, 100.0), beside=name) for name in names[1:]
    }
    for name in (name for name in COMPARED if name in names):
        columns |= {
            name + suffix: Column(f"{TITLES[name].removesuffix(' (%)')}: {words}", limits=(-100.0, 100.0))
            for suffix, (_, words) in DIFFERENCES.items()
        }
    columns[CALLS] = Column("ICP calls", 0, False, (0.0, inf))
    for name, words in _AUROCS.items() if UNSEEN in names else ():
        key = f"{name}_auroc"
        columns[key] = Column(words, 2, False, (0.0, 1.0))
        columns[key + WRONG] = OfSamples(f"{words}: wrong", 0, False, (0.0, inf), beside=key)
    return table.build(
        caption="Accuracy (%) of single-concept attribution with a shortcut closed (change in brackets)"
        + stand_in_clause(sources.values()),
        column_head="control",
        columns=columns,
        footnotes=(
            f"{_seeds_of(table, names)} In brackets: points gained or lost against the paper's protocol, and "
            f"{BOOTSTRAP}. The change is paired: it is taken over the seeds and objects that the control has, so that "
            "it differs from the difference of the two levels where the control has fewer seeds. Bold: best of a "
            "dataset under a control.",
            "Matched density: every cloud has a random number of points, in training and test. Unseen objects: encoder "
            "and explainer learned from other objects. Other sources: they learned from one other source. Wrong "
            "labels: among the explainer's training samples. Shuffled labels teach nothing: guessing gives "
            "33.3, although in a single source and seed whole clusters of samples may be named by chance.",
            "Over untrained: accuracy minus that of the best of chance, the most frequent label and the rule under the "
            "same control; lead: minus that of the best other explainer; both on the same draws, so that it is better "
            "where the interval is above 0. Reads: what an explainer sees of a registration. ICP calls: runs beyond "
            "the one that it explains.",
            "Hard: samples of unseen objects with one to three perturbations, labeled with the one that adds most to "
            "the error by counterfactuals. No start is right, no sensor free of noise, no surface whole, and the "
            "number of points tells nothing. Guessing is right in 33.3 %."
            + rule_near_chance(intervals, sources, control=HARD, metric="accuracy"),
            "AUROC: how well the entropy of the scores separates wrong from right answers; in brackets how many of the "
            "test samples are wrong, and a dash where none is. Elsewhere a dash marks a head that is trained with the "
            "encoder and learns no labels, and a source that does not admit a control.",
        ),
    )


_AUROCS = {PAPER: "AUROC, paper's", UNSEEN: "AUROC, unseen"}


@dataclass(frozen=True)
class OfSamples(Column):
    """Shows a number of test samples, and of how many."""

    def text(self, cell: Cell) -> str:
        """Return e.g. ``24 of 1800``."""
        return f"{cell.mean:.0f} of {cell.test_samples}"


def _seeds_of(table: TableBuilder, names: Sequence[str]) -> str:
    """Return the number of seeds of the paper's protocol, and the controls that have another number."""
    of = {name: [cell.seeds for (_, key), cell in table.cells.items() if key == name] for name in names}
    seeds = {name: span(numbers) for name, numbers in of.items() if numbers}
    usual = seeds.pop(PAPER, str(table.most_seeds()))
    others = [f"{TITLES[name]}: {plural(number, 'seed')}" for name, number in seeds.items() if number != usual]
    return f"Over {plural(usual, 'seed')}" + (f" ({', '.join(others)})." if others else ".")


def _cells(rows: pd.DataFrame, source: str, names: Sequence[str]) -> dict[str, Cell | None]:
    cells: dict[str, Cell | None] = {}
    for name in names:
        trained_on = POOLED if name == TRANSFER else source
        of_control = rows_where(rows, control=name, trained_on=trained_on).set_index("metric")
        if "accuracy" not in of_control.index:
            continue
        accuracy = of_control.loc["accuracy"]
        cells[name] = interval_cell(accuracy)
        cells[name + CHANGE] = change_cell(accuracy) if name != PAPER else None
        for suffix, (key, _) in DIFFERENCES.items() if name in COMPARED else ():
            if isfinite(accuracy[key]):
                cells[name + suffix] = interval_cell(accuracy, key, (f"{key}_low", f"{key}_high"))
        if CALLS in of_control.index:
            cells[CALLS] = plain_cell(of_control.loc[CALLS]["value"], int(accuracy["seeds"]), int(accuracy["samples"]))
        if name in _AUROCS and "auroc_error" in of_control.index:
            key, samples = f"{name}_auroc", int(accuracy["samples"])
            cells[key] = interval_cell(of_control.loc["auroc_error"], factor=1)
            cells[key + WRONG] = plain_cell(round((1 - accuracy["value"]) * samples), int(accuracy["seeds"]), samples)
    return cells


def table10_transfer(intervals: pd.DataFrame, sources: Mapping[str, Mapping], explainers: Mapping[str, str]) -> Table:
    """Return the accuracy of every explainer (rows, by the source that it learned from) on each source (columns)."""
    table = TableBuilder("table10_transfer", {"explainer": "Explainer", "trained_on": "Learned from"})
    titles = titles_of(sources)
    accuracy = rows_where(intervals, metric="accuracy")
    for explainer, words in explainers.items():
        of_explainer = rows_where(accuracy, method=explainer)
        for trained_on, title in titles.items():
            cells: dict[str, Cell | None] = {}
            for tested in titles:
                control = PAPER if tested == trained_on else TRANSFER
                rows = rows_where(of_explainer, control=control, source=tested, trained_on=trained_on)
                cells[tested] = interval_cell(rows.iloc[0]) if len(rows) else None
            table.add_row([(explainer, words), (trained_on, title)], cells)
        elsewhere = rows_where(of_explainer, control=TRANSFER, trained_on=POOLED).set_index("source")
        cells = {name: interval_cell(elsewhere.loc[name]) for name in (*titles, POOLED) if name in elsewhere.index}
        table.add_row([(explainer, words), (POOLED, "another (mean)")], cells)
    return table.build(
        caption="Accuracy (%) from each source to each other" + stand_in_clause(sources.values()),
        column_head="tested",
        columns={**{name: Column(f"on {title}") for name, title in titles.items()}, POOLED: Column("mean")},
        footnotes=(
            "Encoder and explainer learned from one source and are asked about the test samples of another; what they "
            f"learned from is the paper's protocol. Over {plural(table.most_seeds(), 'seed')}; in brackets "
            f"{BOOTSTRAP}.",
        ),
    )


def change_cell(row: pd.Series) -> Cell:
    """Return the change of a row of the intervals against the paper's protocol, in points."""
    return interval_cell(row, "change", ("change_low", "change_high"))
