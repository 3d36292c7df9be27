"""Sentences of the paper, tested by the differences in a run, and a map of the verdicts on the printed numbers."""

import math
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

from gpca.comparison import verdicts as judged
from gpca.comparison.claims import claims as table_of_claims
from gpca.comparison.claims import read_verdicts
from gpca.comparison.published import TEXT, TITLES
from gpca.declarations import Experiment, Figure, Frame, Run, figure, table
from gpca.experiments.active_learning import titles
from gpca.experiments.frames import frames_of
from gpca.experiments.out_of_distribution import learner_titles
from gpca.experiments.recovery import policy_titles
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD
from gpca.io.csv_file import read_numbers
from gpca.reporting.figures import style
from gpca.reporting.figures.style import GRAY, LIGHT_GRAY, SMALL_PT, TEXT_WIDTH_IN

EXPERIMENT = Experiment(name="claims")
SECTION = "What the paper says in sentences"


def compared_sources(run: Run) -> dict[str, Mapping[str, Any]]:
    """Title of all that numbers are of, and whether it is a stand-in: sources, depth frames, model, rendered tables."""
    frames = frames_of(run.config)
    sources = run.sources | {REAL_WORLD: frames, ONE_ENCODER: frames}
    tables = {"title": "Virtual tables", "stand_in": sources[run.config["recovery"]["objects"]]["stand_in"]}
    return {**sources, "model": sources[run.config["model"]["source"]], "recovery": tables}


@table(
    SECTION,
    "Sentences of the paper, tested",
    """Each sentence of the paper with its comparisons: the difference paired by seed, its interval, and whether it
    supports the sentence. "As good as" needs an interval within a margin, not merely one that contains
    zero.""",
    verdicts=(read_verdicts, "claims.csv"),
)
def claims(run: Run, verdicts):
    config = run.config
    called = policy_titles(config) | learner_titles(config) | titles(config["active_learning"]["strategies"])
    called |= run.titles(explainer_entry, config["explainers"])
    return table_of_claims(verdicts, compared_sources(run), called)


NUMBERS = ("difference", "factor")
BY_PAPER = "inconclusive by the paper's own interval"
LOOKS = {  # verdict -> color of a cell, and of the number in it
    judged.REPRODUCED: (style.GREEN, "white"),
    judged.CLOSE: ("#9AD3BF", "black"),
    judged.NOT_REPRODUCED: (style.VERMILION, "white"),
    judged.INCONCLUSIVE: ("white", "black"),
    BY_PAPER: ("#E8E8E8", "black"),
}
OTHER_LOOK = (LIGHT_GRAY, GRAY)
LINES = (("I", "II", "III", "V"), ("IV", "VI", "VII"), (TEXT,))  # tables that stand side by side
SHORT = {"Coffee Cup": "CC", "LINEMOD": "LM", "Linear SVM": "SVM", "No Reduction": "none"}
CELL_IN, ROW_IN, GAP_IN, HEAD_IN = 0.34, 0.16, 0.14, 0.34
LETTER_IN = 0.052  # of a label, on average
TOP_IN = 0.52  # for title and legend
MOST_ROWS = 7  # of the running text in one column


class Block(NamedTuple):
    """Cells of a table: labels of rows and columns, and (row, column) -> the row of the comparison."""

    title: str
    rows: list[str]
    columns: list[str]
    cells: dict[tuple[str, str], dict]

    @property
    def widths_in(self) -> tuple[float, float]:
        """Width of the labels of its rows, and with its cells."""
        labels_in = 0.08 + LETTER_IN * max(len(SHORT.get(name, name)) for name in self.rows)
        return labels_in, labels_in + CELL_IN * len(self.columns)


def read_comparison(path: str | Path) -> Frame:
    return read_numbers(path, judged.COMPARISON_COLUMNS, NUMBERS, optional=NUMBERS)


@figure(
    SECTION,
    "Verdicts on the printed numbers",
    """A cell for each printed mean: green if the run reproduces it (pale: close), red if it does not, white if our
    interval is too wide to say, gray if the paper's own is. The number is how far our value lies above the printed one,
    in the unit of the table, or by what factor it is larger (×) or smaller (÷); > marks a lower bound.""",
    comparison=(read_comparison, "comparison.csv"),
)
def verdicts(run: Run, comparison) -> Figure:
    by_paper = comparison["reason"] == judged.PAPER_TOO_WIDE
    once = judged.judged_once(comparison.assign(verdict=comparison["verdict"].mask(by_paper, BY_PAPER)))
    lines = [line for tables in LINES if (line := [block for table in tables for block in _blocks(table, once)])]
    heights_in = [HEAD_IN + ROW_IN * max(len(block.rows) for block in line) + GAP_IN for line in lines]
    width_in, height_in = TEXT_WIDTH_IN, TOP_IN + sum(heights_in)
    drawing = style.use_style().figure(figsize=(width_in, height_in))
    panel = drawing.add_axes((0, 0, 1, 1), xlim=(0, width_in), ylim=(height_in, 0))
    panel.axis("off")
    for line, top_in in zip(lines, accumulate([TOP_IN, *heights_in[:-1]]), strict=True):
        gap_in, left_in = (width_in - sum(block.widths_in[1] for block in line)) / len(line), 0.0
        for block in line:
            _draw(panel, block, left_in, top_in)
            left_in += block.widths_in[1] + gap_in
    counted, left_in = once["verdict"].value_counts(), 0.05
    for verdict in dict.fromkeys([*LOOKS, *counted.index]):
        words = f"{counted.get(verdict, 0)} {verdict}"
        _cell(panel, left_in, 0.26, LOOKS.get(verdict, OTHER_LOOK)[0], width_in=0.14)
        panel.text(left_in + 0.18, 0.26 + ROW_IN / 2, words, fontsize=SMALL_PT, va="center")
        left_in += 0.36 + LETTER_IN * len(words)
    decided = once["verdict"].isin(judged.DECIDED).sum()
    style.write_title(drawing, f"{decided} of {len(once)} printed means are decided{run.stand_ins()}")
    return drawing


def _blocks(table: str, once: Frame) -> list[Block]:
    """Return the blocks of a table: one, but for the running text, whose numbers have a row each."""
    rows = once[once["table"] == table].to_dict("records")
    if table == TEXT:
        named = [(f"{row['row']}: {row['column']}", row) for row in rows]
        parts = [dict(named[start : start + MOST_ROWS]) for start in range(0, len(named), MOST_ROWS)]
        titles = [TITLES[TEXT]] + [""] * len(parts)
        return [
            Block(title, list(part), [""], {(name, ""): row for name, row in part.items()})
            for title, part in zip(titles, parts, strict=False)
        ]
    crossed = table == "VI"  # backbones by reductions
    cells = {tuple(row["row"].split(", ")[:2]) if crossed else (row["row"], row["column"]): row for row in rows}
    row_labels, column_labels = (list(dict.fromkeys(key[i] for key in cells)) for i in (0, 1))
    return [Block(f"Table {table}", row_labels, column_labels, cells)] if rows else []


def _draw(panel, block: Block, left_in: float, top_in: float) -> None:
    first_in, below_in = left_in + block.widths_in[0], top_in + HEAD_IN
    title_in = (first_in, top_in + 0.08) if block.columns != [""] else (left_in + 0.05, top_in + 0.22)
    panel.text(*title_in, block.title, weight="bold", va="center")
    for j, name in enumerate(block.columns):
        words = SHORT.get(name, name).replace("#Labels ", "")
        place = (first_in + CELL_IN * (j + 0.5), below_in - 0.07)
        panel.text(*place, words, fontsize=SMALL_PT, ha="center", va="center")
    for i, name in enumerate(block.rows):
        middle_in = below_in + ROW_IN * (i + 0.5)
        panel.text(first_in - 0.04, middle_in, SHORT.get(name, name), fontsize=SMALL_PT, ha="right", va="center")
        for j, column in enumerate(block.columns):
            if row := block.cells.get((name, column)):
                color, ink = LOOKS.get(row["verdict"], OTHER_LOOK)
                x_in = first_in + CELL_IN * j
                _cell(panel, x_in, below_in + ROW_IN * i, color)
                look = {"color": ink, "fontsize": SMALL_PT, "ha": "center", "va": "center"}
                panel.text(x_in + CELL_IN / 2, middle_in, _words(row), **look)


def _cell(panel, x_in: float, y_in: float, color: str, width_in: float = CELL_IN) -> None:
    from matplotlib.patches import Rectangle

    look: dict[str, Any] = {"facecolor": color, "edgecolor": GRAY if color == "white" else "white"}
    panel.add_patch(Rectangle((x_in + 0.01, y_in + 0.01), width_in - 0.02, ROW_IN - 0.02, **look))


def _words(row: dict) -> str:
    """Return the difference, or the factor, in a few letters; a lower bound has a sign before it."""
    bound, factor, difference = ">" if row["at_least"] == "True" else "", row["factor"], row["difference"]
    if factor == factor:
        by = max(factor, 1 / factor) if factor else math.inf
        return f"{bound}{'×' if factor >= 1 else '÷'}{by:.{0 if by > 9.9 else 1}f}"
    digits = 1 if abs(difference) >= 0.95 or row["unit"] == "%" else 2
    return "" if difference != difference else f"{bound}{difference:+.{digits}f}"
