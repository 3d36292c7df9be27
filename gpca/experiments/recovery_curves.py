"""Figure of recovery: the share of failures that each policy recovers, by action and by cause."""

from collections.abc import Mapping
from math import nan

from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, figure
from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.experiments.recovery import SECTION, policy_titles, tables_title
from gpca.experiments.recovery_measures import pool_share
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures import style
from gpca.reporting.figures.panels import panels
from gpca.reporting.words import plural

METRICS = {"metrics": "recovery.csv"}
ROW_IN = 0.33  # with less, the markers of one policy overlap
APART = 0.26  # of a row
SHADES = (style.SKY_BLUE, style.BLUE, style.BLACK)  # grows darker with every action


@figure(
    SECTION,
    "Recovery over actions",
    """The share of failures that each policy recovers within one, two and more actions, with its Wilson interval (95
    %). On the right, the share within all actions, by cause, of n failures each. The oracle knows the cause.""",
    **METRICS,
)
def recovery_rates(run: Run, metrics: Frame) -> Figure:
    budget, policies = run.config["recovery"]["loop"]["budget"], policy_titles(run.config)
    shown = _with_rates(metrics, policies)
    drawing, [axes] = panels(1, 2, 0.75 + ROW_IN * len(shown), sharey=True, width_ratios=(1.5, 1))
    for k in range(1, budget + 1):
        offset = APART * (k - (budget + 1) / 2)
        look = {"color": SHADES[(k - 1) % len(SHADES)], "marker": "o", "label": f"within {plural(k, 'action')}"}
        _draw(axes[0], metrics, shown, f"recovered_within_{k}", "all", offset, look)
    for n, cause in enumerate(CONCEPTS):
        _, failures = pool_share(metrics, shown[0], f"recovered_within_{budget}", cause) or (nan, 0)
        label = f"{cause} ($n$ = {failures})"
        look = {"color": style.CONCEPT_COLORS[cause], "marker": style.CONCEPT_MARKERS[cause], "label": label}
        _draw(axes[1], metrics, shown, f"recovered_within_{budget}", cause, APART * (n - 1), look)
    axes[0].set_yticks(range(len(shown)), [policies[name] for name in shown])
    axes[0].set_ylim(len(shown) - 0.4, -0.6)
    for panel in axes:
        panel.set_xlim(-2, 102)
        panel.set_xlabel("recovered (%)")
        panel.grid(axis="x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
        spacing = {"handletextpad": 0.2, "columnspacing": 1.0, "borderpad": 0}
        panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, **spacing)
    _, episodes = pool_share(metrics, shown[0], "recovered_within_1") or (nan, 0)
    style.write_title(drawing, f"{tables_title(run)}: {episodes} failures; right: within {budget} actions, by cause")
    return drawing


def _draw(axes, metrics, shown, metric: str, concept: str, offset: float, look: Mapping[str, str]) -> None:
    """Rates of one kind, a little above or below the middle of each policy's row, with their intervals."""
    rates = {row: r for row, name in enumerate(shown) if (r := pool_share(metrics, name, metric, concept))}
    for row, (share, trials) in rates.items():
        low, high = wilson_interval(share * trials, trials)
        axes.plot([100 * low, 100 * high], [row + offset] * 2, color=look["color"], linewidth=0.8)
    shares = [100 * share for share, _ in rates.values()]
    axes.plot(shares, [row + offset for row in rates], linestyle="", markersize=3.5, **look)


def _with_rates(metrics: Frame, policies: Mapping[str, str]) -> list[str]:
    shown = [name for name in policies if pool_share(metrics, name, "recovered_within_1")]
    if not shown:
        raise InputError("metrics", "have no recovery rates", "run the step recover first")
    return shown
