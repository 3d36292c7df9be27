"""Figure of recovery: the share of failures that policies recover, and their lead over fixed actions."""

from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, figure
from gpca.errors import InputError
from gpca.evaluation.measures import ALL
from gpca.experiments.recovery import SECTION, policy_titles, tables_title
from gpca.experiments.recovery_measures import SEQUENCE
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import panels
from gpca.reporting.tables.cells import rows_where
from gpca.reporting.words import plural

SHOWN = ("random", "gpca", "gpca_acting", "utility_acting", "reenact", "repair_gpca", "oracle")
ROW_IN, APART = 0.3, 0.13  # height of a row, and distance of its marks from the middle


@figure(
    SECTION,
    "Recovery over actions",
    """The share of failures that policies recover within one action and within all, and how many points more within one
    action than the best fixed sequence, which is chosen in hindsight. Bars are 95 % intervals of a bootstrap over
    tables and seeds, on the right of the paired difference. The oracle knows the cause; another action may help.""",
    intervals="recovery_intervals.csv",
    differences="recovery_differences.csv",
)
def recovery_rates(run: Run, intervals: Frame, differences: Frame) -> Figure:
    budget, titles = run.config["recovery"]["loop"]["budget"], policy_titles(run.config)
    looks = {1: (style.SKY_BLUE, -APART), budget: (style.BLACK, APART)}
    rates = {k: rows_where(intervals, metric=f"recovered_within_{k}", concept=ALL).set_index("method") for k in looks}
    first = rates[1][rates[1].index.isin(list(titles))]["value"].sort_values()
    leads = rows_where(differences, metric="recovered_within_1", concept=ALL, against=SEQUENCE).set_index("method")
    shown = [name for name in first.index if name in (*SHOWN, *leads["other"])]
    if not shown:
        raise InputError("intervals", "have no recovery rates", "run the step recover first")
    drawing, [[left, right]] = panels(1, 2, 0.8 + ROW_IN * len(shown), sharey=True, width_ratios=(1.5, 1))
    for row, name in enumerate(shown):
        for k, (color, offset) in looks.items():
            if name in rates[k].index:
                label = f"within {plural(k, 'action')}" if row == 0 else None
                _mark(left, rates[k].loc[name], row + offset, color, label)
        if name in leads.index:
            _mark(right, leads.loc[name], row, style.BLUE)
    left.set_yticks(range(len(shown)), [titles[name] for name in shown])
    left.set(xlim=(-2, 102), ylim=(-0.6, len(shown) - 0.4), xlabel="recovered (%)")
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    right.axvline(0, color=style.GRAY, linewidth=0.6)
    right.set_xlabel("more than the best sequence (points)")
    for panel in (left, right):
        panel.grid(axis="x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
    style.write_title(drawing, f"{tables_title(run)}: {int(rates[1].loc[shown[0], 'samples'])} failures")
    return drawing


def _mark(panel, row, height: float, color: str, label: str | None = None) -> None:
    """Draw a share or difference with its interval."""
    panel.plot([100 * row["low"], 100 * row["high"]], [height] * 2, color=color, linewidth=1.0)
    panel.plot(100 * row["value"], height, "o", color=color, markersize=3.5, label=label)
