"""Table X: accuracy under the controls, and from each source to each other."""

from typing import Any

import numpy as np

from gpca.declarations import Figure, Run, figure, table
from gpca.errors import InputError
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.cause_tables import COUNTS, rule_near_chance
from gpca.experiments.controls import CALLS, OF_TRIVIAL, RIVAL, SECTION, USUAL
from gpca.explainers.registry import explainer_entry
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import SMALL_PT
from gpca.reporting.sheet import Sheet, Show, crossed, plain_cell, plural, rows_where, show, span, with_label
from gpca.steps import control_samples as samples_of
from gpca.steps.control_samples import HARD, PAPER, TRANSFER, UNSEEN

INTERVALS = {"intervals": "control_intervals.csv"}
TITLES = {
    PAPER: "Paper's protocol (%)",
    "density": "Matched density",
    UNSEEN: "Unseen objects",
    HARD: "Hard",
    TRANSFER: "Other sources",
    "reversed": "ICP reversed",
    **{name: f"{100 * share:g} % wrong labels" for name, share in samples_of.WRONG_LABELS.items()},
    "shuffled": "Shuffled labels",
}
CHANGE = "_change"  # suffix of a control: the column of differences from the paper's protocol
DIFFERENCES = {"_gain": (OF_TRIVIAL, "over trivial (points)"), "_lead": (RIVAL, "lead (points)")}
POINTS = (-100.0, 100.0)


@table(
    SECTION,
    "Table X: with the shortcuts closed",
    """Every explainer with a shortcut closed: clouds whose density says nothing, unseen objects and sources, reversed
    ICP, and wrong labels. In brackets is the paired change against the paper's protocol with its interval.""",
    **INTERVALS,
)
def table10_controls(run: Run, intervals):
    explainers = run.titles(explainer_entry, run.config["controls"]["explainers"])
    names = [PAPER, *(name for name in TITLES if name in run.config["controls"]["controls"])]

    def accuracy(name: str, title: str, against: str = "", **options: Any) -> Show:
        trained_on = POOLED if name == TRANSFER else ALL
        return show("accuracy", title, trained_on, {"table": name, "against": against}, **options)

    columns = {name: accuracy(name, TITLES[name], interval=False) for name in names}
    for name in names[1:]:
        columns[name + CHANGE] = accuracy(name, f"{TITLES[name]}: change", USUAL, limits=POINTS, beside=name)
    for name in [name for name in (PAPER, UNSEEN, HARD) if name in names]:
        for suffix, (against, words) in DIFFERENCES.items():
            title = f"{TITLES[name].removesuffix(' (%)')}: {words}"
            columns[name + suffix] = accuracy(name, title, against, limits=POINTS)
    columns[CALLS] = show(CALLS, "ICP calls", where={"table": PAPER}, factor=1, **COUNTS)
    rows = with_label(
        crossed(("source", {POOLED: "All together"} | run.source_titles), ("method", explainers)),
        lambda row: explainer_entry(row.where["method"]).sight,
    )
    heads = {"source": "Dataset", "explainer": "Explainer", "reads": "Reads"}
    sheet = Sheet("table10_controls", heads, rows, columns, intervals)
    for (i, key), cell in list(sheet.cells.items()):
        if key == CALLS:
            sheet.cells[i, key] = plain_cell(cell.mean, cell.seeds, cell.test_samples)
    filled = [name for name in names if any(key == name for _, key in sheet.cells)]
    seeds = {name: span(cell.seeds for (_, key), cell in sheet.cells.items() if key == name) for name in filled}
    usual = seeds.pop(PAPER, str(sheet.seeds))
    fewer = ", ".join(f"{TITLES[name]}: {plural(number, 'seed')}" for name, number in seeds.items() if number != usual)
    notes = (
        f"Over {plural(usual, 'seed')}{f' ({fewer})' if fewer else ''}. In brackets: points gained or lost against the "
        "paper's protocol on the seeds and objects that the control has, and the 95 % interval of a bootstrap over "
        f"objects and seeds ({REPEATS} draws). Bold: best of a dataset under a control.",
        "Matched density: every cloud has a random number of points, in training and test. Unseen objects, other "
        "sources: encoder and explainer learned from others. Wrong labels: among the explainer's training samples. "
        "Shuffled labels teach nothing: guessing gives 33.3, although in a single source and seed whole clusters of "
        "samples may be named by chance. A dash: a head that is trained with the encoder learns no labels, and one "
        "source admits no other.",
        "Over trivial, lead: accuracy minus that of the best trivial row (chance to density, and hypotheses with "
        "thresholds), and of the best other explainer, under the same control and on the same draws. Reads: what an "
        "explainer sees of a registration. ICP calls: runs beyond the one that it explains.",
        "Hard: samples of unseen objects with all perturbations, labeled with the one that adds most to the error by "
        "counterfactuals, and drawn so that ten trivial numbers know nothing of it. What reads no embedding learns "
        "from all sources, but from no family that is tested. Guessing is right in 33.3 %."
        + rule_near_chance(intervals, run.sources, table=HARD, metric="accuracy", against=""),
    )
    caption = "Accuracy (%) of single-concept attribution with a shortcut closed (change in brackets)" + run.stand_ins()
    return sheet.table(caption, "control", notes, bold=[name for name in names if name != "shuffled"], same=1)


@table(
    SECTION,
    "Table X: from each source to each other",
    """Accuracy of every explainer on the source that it learned from and on the others. If the rows of one explainer
    are alike, it does not matter where it learned.""",
    needs=("transfer_source",),
    **INTERVALS,
)
def table10_transfer(run: Run, intervals):
    import pandas as pd

    accuracies = rows_where(intervals, metric="accuracy", against="")
    own = accuracies[(accuracies["table"] == PAPER) & (accuracies["source"] != POOLED)]
    measured = pd.concat([own.assign(concept=own["source"]), rows_where(accuracies, table=TRANSFER)])
    explainers = run.titles(explainer_entry, run.config["controls"]["explainers"])
    rows = crossed(("method", explainers), ("concept", run.source_titles | {POOLED: "another (mean)"}))
    columns = {name: Show(f"on {title}", where={"source": name}) for name, title in run.source_titles.items()}
    columns[POOLED] = Show("mean", where={"source": POOLED})
    heads = {"explainer": "Explainer", "trained_on": "Learned from"}
    sheet = Sheet("table10_transfer", heads, rows, columns, measured)
    notes = [f"{sheet.over(clusters='objects')}."]
    return sheet.table("Accuracy (%) from each source to each other" + run.stand_ins(), "tested", notes)


STEPS = {PAPER: "paper's protocol", UNSEEN: "unseen objects", TRANSFER: "other sources", HARD: "hard"}
SIDE = 0.08  # between the marks of two explainers
LEAST_APART = 6.0  # between two numbers, so that both can be read
LOOKS = {
    "rule": style.BLACK,
    "gpca": style.BLUE,
    "gpca_pair": style.GREEN,
    "pair_forest": style.VERMILION,
    "reenact": style.PURPLE,
}


@figure(
    SECTION,
    "Who passes when the shortcuts are closed",
    """Accuracy over all sources under the paper's protocol, on unseen objects, on a source that nothing was learned
    from, and on hard samples, with 95 % intervals over objects and seeds. The dotted line is chance. The re-enactment
    is measured on hard samples alone.""",
    **INTERVALS,
)
def loophole(run: Run, intervals) -> Figure:
    source = POOLED if len(run.sources) > 1 else next(iter(run.sources))
    rows = rows_where(intervals, source=source, metric="accuracy", against="")
    rows = rows[rows["concept"].isin([ALL, POOLED])]
    explainers = run.titles(explainer_entry, run.config["controls"]["explainers"])
    shown = [name for name in LOOKS if name in explainers and (rows["method"] == name).any()]
    if not shown:
        raise InputError("intervals", "have no accuracy of these explainers", "run the controls first")
    drawing, [[panel]] = panels(1, 1, 2.7, style.COLUMN_WIDTH_IN)
    ends: dict[str, float] = {}
    for k, name in enumerate(shown):
        by_table = rows_where(rows, method=name).set_index("table")
        there = [table for table in STEPS if table in by_table.index]
        values = 100 * by_table.loc[there, ["value", "low", "high"]].to_numpy(float)
        across = [list(STEPS).index(table) + SIDE * (k - (len(shown) - 1) / 2) for table in there]
        spread = np.maximum([values[:, 0] - values[:, 1], values[:, 2] - values[:, 0]], 0)  # but for rounding
        look = {"color": LOOKS[name], "marker": "o", "ms": 3.5, "lw": 1.2, "elinewidth": 0.8}
        panel.errorbar(across, values[:, 0], spread, label=explainers[name], **look)
        ends[name] = values[-1, 0]
    height = 0.0
    for name in sorted(ends, key=ends.__getitem__):
        height = max(ends[name], height + LEAST_APART)
        panel.text(len(STEPS) - 0.75, height, f"{ends[name]:.0f}", va="center", size=SMALL_PT, color=LOOKS[name])
    panel.axhline(100 / 3, color=style.GRAY, lw=0.8, ls=":")
    panel.set_xticks(range(len(STEPS)), STEPS.values())
    panel.set(xlim=(-0.45, len(STEPS) - 0.55), ylim=(0, 104), ylabel="accuracy (%)")
    handles, labels = panel.get_legend_handles_labels()
    legend_below(drawing, handles, labels, columns=2, fontsize=SMALL_PT)
    style.write_title(drawing, "All together" if source == POOLED else run.source_titles[source])
    return drawing
