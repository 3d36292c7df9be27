"""Writes a table as CSV for machines, Markdown for readers, LaTeX for the paper and JSON for the page."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpca.io.files import whole_file

EMPTY = "–"  # A dash stands where there is no number.
LEAST_SEEDS = 3  # A mean over fewer has no interval: that of two spans everything, however near they lie.
SHARE = (0.0, 100.0)  # limits of a share in percent
_COLUMN_CHARACTERS = 50  # This many fill one column of a two-column paper.
_TEXT_CHARACTERS = 100  # This many fill both columns.
_SCALED_DOWN = r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{%"


@dataclass(frozen=True)
class Cell:
    """Holds a mean over `seeds` repeats, the half-width of its 95 % t-interval, all test samples.

    The half-width is NaN where there is no interval, as over fewer than `LEAST_SEEDS`. A mean that is `at_least` so
    large has none either, since some repeats were stopped before they were done. Another interval than that over the
    seeds (a bootstrap's, Wilson's) has `bounds`, and is printed by these. `clusters` are the combinations of a seed
    and a cluster that the samples are of; 0 where their number is not known.
    """

    mean: float
    half_width: float
    seeds: int
    test_samples: int
    at_least: bool = False
    bounds: tuple[float, float] | None = None
    clusters: int = 0


@dataclass(frozen=True)
class Column:
    """Says how one quantity is shown: its title, the digits after the point, with an interval or without.

    `limits` are the least and the largest possible value; the bounds in the CSV are clipped to them. Of some
    quantities, as the labels that were needed, the least is best. A column `beside` another has none of its own: its
    cells stand with their sign in brackets behind the other's; the CSV holds both. Of a quantity with a `heavy_tail`,
    an interval wider than the mean is not printed, as it would reach below zero. `of_samples` is False for percentages
    that are no shares of samples, such as mean confidences.
    """

    title: str
    decimals: int = 1
    interval: bool = True
    limits: tuple[float, float] = SHARE
    least_is_best: bool = False
    beside: str = ""
    heavy_tail: bool = False
    of_samples: bool = True

    def text(self, cell: Cell) -> str:
        """Return e.g. ``97.7 ± 0.4``, ``97.7 (96.9 to 98.2)`` or ``> 52.0``; beside another ``+1.2; 0.4 to 1.9``."""
        mean = f"{cell.mean:{'+' if self.beside else ''}z.{self.decimals}f}"
        if cell.at_least:
            return f"> {mean}"
        if not self.interval or math.isnan(cell.half_width) or (self.heavy_tail and cell.half_width > cell.mean):
            return mean
        if cell.bounds:
            bounds = " to ".join(f"{bound:z.{self.decimals}f}" for bound in cell.bounds)
            return f"{mean}; {bounds}" if self.beside else f"{mean} ({bounds})"
        return f"{mean} ± {cell.half_width:.{self.decimals}f}"


@dataclass(frozen=True)
class Table:
    """Holds rows by columns of cells; every name has a key for the CSV and a title for the reader.

    Attributes:
        name: The file name without suffix, e.g. ``table1_single_baselines``.
        caption: The line that says what the numbers are, their unit, and on which objects.
        row_heads: The title of each row label by key, e.g. ``{"source": "Dataset"}``.
        rows: The labels of each row, a key and a title for each row head.
        column_head: The key of what the columns are, e.g. ``explainer``.
        columns: The :class:`Column` of each key, in order.
        cells: The cells by row number and column key; a missing one is drawn as a dash.
        footnotes: The sentences that a reader needs to judge the numbers.
        compared: Groups of such keys; the best printed mean of each group is set in bold.
    """

    name: str
    caption: str
    row_heads: Mapping[str, str]
    rows: tuple[tuple[tuple[str, str], ...], ...]
    column_head: str
    columns: Mapping[str, Column]
    cells: Mapping[tuple[int, str], Cell]
    footnotes: tuple[str, ...] = ()
    compared: tuple[Sequence[tuple[int, str]], ...] = ()

    def best(self) -> set[tuple[int, str]]:
        """Return the keys of the cells with the best printed mean of their group.

        None are of a group of one, nor where all share the best, or more than half of a large group: that tells nothing
        apart. A mean over fewer seeds than an interval takes is never the best.
        """
        best: set[tuple[int, str]] = set()
        for group in self.compared:
            cells = {key: self.cells[key] for key in group if key in self.cells}
            printed = {
                key: round(cell.mean, self.columns[key[1]].decimals)
                for key, cell in cells.items()
                if not cell.at_least and (cell.seeds >= LEAST_SEEDS or cell.bounds)
            }
            if printed and len(cells) > 1:
                choose = min if self.columns[next(iter(printed))[1]].least_is_best else max
                chosen = {key for key, mean in printed.items() if mean == choose(printed.values())}
                tells_apart = len(chosen) < len(cells) and (len(chosen) <= 5 or 2 * len(chosen) <= len(cells))
                best |= chosen if tells_apart else set()
        return best

    def write(self, stem: str | Path) -> None:
        """Write ``{stem}.csv``, ``.md``, ``.tex`` and, for the page, ``.json``: each whole or not at all."""
        page = json.dumps(self.printed(), indent=1, ensure_ascii=False) + "\n"
        for suffix, text in (("md", self.markdown()), ("tex", self.latex()), ("json", page)):
            with whole_file(f"{stem}.{suffix}") as partial:
                partial.write_text(text, encoding="utf-8")
        with whole_file(f"{stem}.csv") as partial, partial.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(self.records())

    def printed(self) -> dict[str, Any]:
        """Return the words that a reader sees; each cell is its text, and whether it is bold."""
        best, rows = self.best(), []
        for row, labels in enumerate(self.rows):
            numbers = [(self._text(row, name), (row, name) in best) for name in self._own_columns()]
            rows.append([*((title, False) for _, title in labels), *numbers])
        return {
            "caption": self.caption,
            "heads": [*self.row_heads.values(), *(column.title for column in self._own_columns().values())],
            "label_columns": len(self.row_heads),
            "rows": rows,
            "footnotes": list(self.footnotes),
        }

    def records(self) -> list[tuple]:
        """Return the CSV's rows, head first: one row per cell, in its column's unit, `n_test` over all seeds."""
        heads = (*self.row_heads, self.column_head, "mean", "ci_low", "ci_high", "n_seeds", "n_test", "at_least")
        records: list[tuple] = [heads]
        for row, labels in enumerate(self.rows):
            for name, column in self.columns.items():
                cell = self.cells.get((row, name))
                if cell is None:
                    continue
                least, most = column.limits
                low, high = (
                    "" if cell.at_least or math.isnan(cell.half_width) else round(min(max(bound, least), most), 6)
                    for bound in cell.bounds or (cell.mean - cell.half_width, cell.mean + cell.half_width)
                )
                keys = (key for key, _ in labels)
                counts = (cell.seeds, cell.test_samples, cell.at_least)
                records.append((*keys, name, round(cell.mean, 6), low, high, *counts))
        return records

    def markdown(self) -> str:
        """Return a GitHub table, caption above, footnotes below."""
        rule = [":--"] * len(self.row_heads) + ["--:"] * len(self._own_columns())
        body = self._body(lambda text: text.replace("|", "\\|"), lambda text: f"**{text}**")
        lines = [" | ".join(row) for row in (self.printed()["heads"], rule, *body)]
        table = "\n".join(f"| {line} |" for line in lines)
        return "\n\n".join([f"**{self.caption}**", table, *self.footnotes]) + "\n"

    def latex(self) -> str:
        r"""Return a floating table; it needs ``\usepackage{booktabs}`` and spans both columns when it is wide.

        A table that may be wider than the text is scaled down to it, which needs ``graphicx`` too.
        """
        plain = [self.printed()["heads"], *self._body(str, str)]
        characters = sum(2 + max(map(len, column)) for column in zip(*plain, strict=True))
        float_name = "table" if characters <= _COLUMN_CHARACTERS else "table*"
        alignments = "l" * len(self.row_heads) + "c" * len(self._own_columns())
        begin = rf"\begin{{tabular}}{{{alignments}}}"
        end = r"\end{tabular}"
        packages = "booktabs"
        if characters > _TEXT_CHARACTERS:
            begin = f"{_SCALED_DOWN}\n{begin}"
            end += "}"
            packages = "booktabs, graphicx"
        heads = [r"\textbf{" + _tex(title) + "}" for title in plain[0]]
        body = self._body(_tex, lambda text: r"\textbf{" + text + "}")
        return "\n".join(
            [
                rf"% needs \usepackage{{{packages}}}",
                rf"\begin{{{float_name}}}[t]",
                r"\centering",
                rf"\caption{{{_tex(self.caption)}}}",
                rf"\label{{tab:{self.name}}}",
                r"\small",
                begin,
                r"\toprule",
                " & ".join(heads) + r" \\",
                r"\midrule",
                *(" & ".join(row) + r" \\" for row in body),
                r"\bottomrule",
                end,
                *(rf"\par\smallskip{{\footnotesize {_tex(footnote)}}}" for footnote in self.footnotes),
                rf"\end{{{float_name}}}",
                "",
            ]
        )

    def _own_columns(self) -> dict[str, Column]:
        return {name: column for name, column in self.columns.items() if not column.beside}

    def _text(self, row: int, name: str) -> str:
        cell = self.cells.get((row, name))
        if cell is None:
            return EMPTY
        beside = [(key, column) for key, column in self.columns.items() if column.beside == name]
        texts = [column.text(self.cells[row, key]) for key, column in beside if (row, key) in self.cells]
        return " ".join([self.columns[name].text(cell), *(f"({text})" for text in texts)])

    def _body(self, escape, bold) -> list[list[str]]:
        return [[bold(escape(text)) if b else escape(text) for text, b in row] for row in self.printed()["rows"]]


_TEX = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "±": r"$\pm$",
    "×": r"$\times$",
    "–": "--",
    "ρ": r"$\rho$",
    "σ": r"$\sigma$",
    "°": r"$^\circ$",
    "é": r"\'e",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
} | {sign: "\\" + sign for sign in "&%$#_{}"}


def _tex(text: str) -> str:
    """Escape the characters special to LaTeX; a hyphen before a number is a minus."""
    return re.sub(r"(?<![\w-])-(?=\d)", "$-$", "".join(_TEX.get(sign, sign) for sign in text))
