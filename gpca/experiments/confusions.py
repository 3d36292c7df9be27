"""Confusion matrices of a few explainers in one row, pooled over sources and seeds."""

from collections.abc import Iterable, Mapping

from gpca.attribution.metrics import ABSTAINED, PREDICTED_AS
from gpca.declarations import Figure, Frame
from gpca.errors import InputError
from gpca.reporting.figures.panels import draw_percentages, in_lines, panels
from gpca.reporting.figures.style import TEXT_WIDTH_IN, write_title

MOST = 4  # matrices that fit into a row
LABELS_IN, MATRIX_IN = 0.6, 1.62  # width of the letters at the left, and of a matrix with its gap
ROW_OF_TITLE_IN = 0.13


def draw_confusions(
    metrics: Frame, explainers: Mapping[str, str], first: Iterable[str], title: str, form: str = "{:.0f} %"
) -> Figure:
    """Draw the share of each true concept (rows) that is taken for each (columns), for at most `MOST` explainers.

    `explainers` are titles by name, of which the `first` are drawn before others. The `form` of a cell has a second
    pair of braces for its count. What is missing to 100 % is abstained.
    """
    confusions = pooled_confusions(metrics)
    ordered = [name for name in dict.fromkeys((*first, *explainers)) if name in explainers and name in confusions]
    if not ordered:
        raise InputError("confusions", "are of none of these explainers", "collect the metrics again")
    shown = ordered[:MOST]
    titles = [in_lines(explainers[name]) for name in shown]
    width_in = min(TEXT_WIDTH_IN, max(3.2, LABELS_IN + MATRIX_IN * len(shown)))
    room_in = 0.5 + ROW_OF_TITLE_IN * max(words.count("\n") + 1 for words in titles)
    drawing, [axes] = panels(1, len(shown), (width_in - LABELS_IN) / len(shown) + room_in, width_in, sharey=True)
    for panel, name, words in zip(axes, shown, titles, strict=True):
        concepts = list(confusions[name].columns[:-1])
        counts_C_C1 = confusions[name].reindex(concepts).to_numpy(float)
        percent_C_C1 = 100 * counts_C_C1 / counts_C_C1.sum(axis=1, keepdims=True)
        draw_percentages(panel, percent_C_C1[:, :-1], form, counts_C_C1[:, :-1], linespacing=1.2)
        panel.set_title(words, pad=3)
        panel.set_xticks(range(len(concepts)), concepts)
        panel.set_yticks(range(len(concepts)), concepts, rotation=90, va="center")
        panel.tick_params(length=0, pad=2)
        panel.spines[:].set(visible=True, linewidth=0.4)
    axes[0].set_ylabel("true", labelpad=3)
    drawing.supxlabel("attributed to", fontsize=8)
    write_title(drawing, title)
    return drawing


def pooled_confusions(metrics: Frame) -> dict[str, Frame]:
    """Counts of each explainer over all sources and seeds: rows true concepts; columns predicted, abstained last."""
    counts = metrics[metrics["metric"].str.startswith(PREDICTED_AS)]
    counts = counts.assign(predicted=counts["metric"].str.removeprefix(PREDICTED_AS))
    pooled = {}
    for name, rows in counts.groupby("method", sort=False):
        table = rows.pivot_table("value", "concept", "predicted", aggfunc="sum", fill_value=0, sort=False)
        pooled[name] = table[[column for column in table.columns if column != ABSTAINED] + [ABSTAINED]]
    return pooled
