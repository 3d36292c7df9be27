"""A table of means over seeds, written as CSV for machines, Markdown for readers and LaTeX for the paper."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gpca.files import whole_file

EMPTY = "–"  # what is drawn where there is no number


@dataclass(frozen=True)
class Cell:
    """Mean over `seeds` repeats, the half-width of its 95 % t-interval (NaN for one seed), test samples in all."""

    mean: float
    half_width: float
    seeds: int
    test_samples: int

    def text(self, decimals: int) -> str:
        """Return e.g. ``97.7 ± 0.4``."""
        half_width = EMPTY if math.isnan(self.half_width) else f"{self.half_width:.{decimals}f}"
        return f"{self.mean:.{decimals}f} ± {half_width}"


@dataclass(frozen=True)
class Table:
    """Rows by columns of cells; every name has a key for the CSV and a title for the reader.

    Attributes:
        name: file name without suffix, e.g. ``table1_single_baselines``.
        caption: what the numbers are, their unit, and on which objects.
        row_heads: key -> title of each row label, e.g. ``{"source": "Dataset"}``.
        rows: for each row its labels, key -> title each, one label per row head.
        column_head: key of what the columns are, e.g. ``explainer``.
        columns: key -> title, in order.
        cells: (row number, column key) -> cell; a missing one is drawn as a dash.
        footnotes: what a reader needs to know to judge the numbers.
        compared: columns among which the best of a row is set in bold; all when empty.
        decimals: digits after the point in Markdown and LaTeX.
        limits: the least and the largest possible value; the bounds in the CSV are clipped to them.
    """

    name: str
    caption: str
    row_heads: Mapping[str, str]
    rows: tuple[tuple[tuple[str, str], ...], ...]
    column_head: str
    columns: Mapping[str, str]
    cells: Mapping[tuple[int, str], Cell]
    footnotes: tuple[str, ...] = ()
    compared: tuple[str, ...] = ()
    decimals: int = 1
    limits: tuple[float, float] = (0.0, 100.0)

    def best(self, row: int) -> set[str]:
        """Return the columns of `row` whose printed mean is the largest; none where fewer than two are compared."""
        printed = {
            column: round(self.cells[row, column].mean, self.decimals)
            for column in (self.compared or self.columns)
            if (row, column) in self.cells
        }
        if len(printed) < 2:
            return set()
        best = max(printed.values())
        return {column for column, value in printed.items() if value == best}

    def write(self, csv_path: str | Path, md_path: str | Path, tex_path: str | Path) -> None:
        """Write the three files, each whole or not at all."""
        for path, text in ((md_path, self.markdown()), (tex_path, self.latex())):
            with whole_file(path) as partial:
                partial.write_text(text, encoding="utf-8")
        with whole_file(csv_path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows(self.records())

    def records(self) -> list[tuple]:
        """Return the CSV's rows, head first: one row per cell, in the table's unit, `n_test` over all seeds."""
        heads = (*self.row_heads, self.column_head, "mean", "ci_low", "ci_high", "n_seeds", "n_test")
        records: list[tuple] = [heads]
        for row, labels in enumerate(self.rows):
            for column in self.columns:
                cell = self.cells.get((row, column))
                if cell is None:
                    continue
                low, high = (
                    "" if math.isnan(cell.half_width) else round(min(max(bound, self.limits[0]), self.limits[1]), 6)
                    for bound in (cell.mean - cell.half_width, cell.mean + cell.half_width)
                )
                keys = (key for key, _ in labels)
                records.append((*keys, column, round(cell.mean, 6), low, high, cell.seeds, cell.test_samples))
        return records

    def markdown(self) -> str:
        """Return a GitHub table, caption above, footnotes below."""
        heads = [*self.row_heads.values(), *self.columns.values()]
        rule = [":--"] * len(self.row_heads) + ["--:"] * len(self.columns)
        body = self._body(lambda text: text.replace("|", "\\|"), lambda text: f"**{text}**")
        lines = [" | ".join(row) for row in (heads, rule, *body)]
        table = "\n".join(f"| {line} |" for line in lines)
        return "\n\n".join([f"**{self.caption}**", table, *self.footnotes]) + "\n"

    def latex(self) -> str:
        r"""Return a floating table; it needs ``\usepackage{booktabs}`` and spans both columns when it is wide."""
        plain = [[*self.row_heads.values(), *self.columns.values()], *self._body(str, str)]
        characters = sum(2 + max(map(len, column)) for column in zip(*plain, strict=True))
        float_name = "table" if characters <= 50 else "table*"  # 50 fill a column of a two-column paper
        heads = [r"\textbf{" + _tex(title) + "}" for title in (*self.row_heads.values(), *self.columns.values())]
        body = self._body(_tex, lambda text: r"\textbf{" + text + "}")
        return "\n".join(
            [
                "% needs \\usepackage{booktabs}",
                rf"\begin{{{float_name}}}[t]",
                r"\centering",
                rf"\caption{{{_tex(self.caption)}}}",
                rf"\label{{tab:{self.name}}}",
                r"\small",
                rf"\begin{{tabular}}{{{'l' * len(self.row_heads)}{'c' * len(self.columns)}}}",
                r"\toprule",
                " & ".join(heads) + r" \\",
                r"\midrule",
                *(" & ".join(row) + r" \\" for row in body),
                r"\bottomrule",
                r"\end{tabular}",
                *(rf"\par\smallskip{{\footnotesize {_tex(footnote)}}}" for footnote in self.footnotes),
                rf"\end{{{float_name}}}",
                "",
            ]
        )

    def _body(self, escape, bold) -> list[list[str]]:
        body = []
        for row, labels in enumerate(self.rows):
            texts = [escape(title) for _, title in labels]
            best = self.best(row)
            for column in self.columns:
                cell = self.cells.get((row, column))
                text = escape(cell.text(self.decimals)) if cell else escape(EMPTY)
                texts.append(bold(text) if column in best else text)
            body.append(texts)
        return body


_TEX = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "±": r"$\pm$",
    "×": r"$\times$",
    "–": "--",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
} | {sign: "\\" + sign for sign in "&%$#_{}"}


def _tex(text: str) -> str:
    return "".join(_TEX.get(sign, sign) for sign in text)
