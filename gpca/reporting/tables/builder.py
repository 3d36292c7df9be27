"""Builds a table row by row: it knows which rows have cells, which compete for bold, and what all tables say below."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

from gpca.errors import InputError
from gpca.evaluation.intervals import REPEATS
from gpca.reporting.tables.cells import share_within_limits
from gpca.reporting.tables.table import LEAST_SEEDS, Cell, Column, Table
from gpca.reporting.words import plural

INTERVAL = "± is the half-width of the 95 % t-interval over the seeds"
NEAR_LIMITS = (
    "In brackets, where that is 0 or reaches beyond 0 or 100 %: the farther bounds of it and of Wilson's interval, for "
    "which a cluster of objects or scenes counts once in each seed (docs/comparison.md)."
)
FAMILIES = "families of objects"  # the clusters of most tables
Label = tuple[str, str]  # key for the CSV, title for the reader


class TableBuilder:
    """Collects labeled rows of cells; whatever needs a row raises an InputError where there is none."""

    def __init__(self, name: str, row_heads: Mapping[str, str]) -> None:
        self.name = name
        self.row_heads = row_heads
        self.labels: list[tuple[Label, ...]] = []  # of each row
        self.cells: dict[tuple[int, str], Cell] = {}  # by row number and column key
        self._rivals: list[int] = []
        self._compared: list[list[tuple[int, str]]] = []

    def add_row(self, labels: Sequence[Label], cells: Mapping[str, Cell | None], rival: bool = True) -> None:
        """Add a row unless it has no cell; only rivals compete for bold, which an oracle is not."""
        given = {(len(self.labels), key): cell for key, cell in cells.items() if cell is not None}
        if given:
            self._rivals += [len(self.labels)] if rival else []
            self.labels.append(tuple(labels))
            self.cells |= given

    def compare_across(self, columns: Iterable[str]) -> None:
        """Let these columns compete for bold within each row."""
        columns = list(columns)
        self._compared += [[(row, key) for key in columns] for row in range(len(self.labels))]

    def compare_down(self, columns: Iterable[str], same: int = 0) -> None:
        """Let the rivals whose first `same` labels agree compete for bold within each of these columns."""
        groups: dict[tuple, list[tuple[int, str]]] = {}
        for key, row in product(columns, self._rivals):
            groups.setdefault((self.labels[row][:same], key), []).append((row, key))
        self._compared += groups.values()

    def require_rows(self) -> None:
        """Raise an InputError if no row was added."""
        if not self.labels:
            fault = "has nothing to show: its files hold no numbers of what the config names"
            raise InputError(f"table '{self.name}'", fault, "run that first")

    @property
    def seeds(self) -> int:
        """Number of seeds of the cell that has the most."""
        return max(cell.seeds for cell in self.cells.values())

    def build(self, caption: str, column_head: str, columns: Mapping[str, Column], footnotes: Iterable[str]) -> Table:
        """Return the table with its columns, which may depend on the cells that there are."""
        self.require_rows()
        cells = {key: share_within_limits(cell, columns[key[1]]) for key, cell in self.cells.items()}
        widened = any(cell is not self.cells[key] and columns[key[1]].interval for key, cell in cells.items())
        return Table(
            name=self.name,
            caption=caption,
            row_heads=self.row_heads,
            rows=tuple(self.labels),
            column_head=column_head,
            columns=columns,
            cells=cells,
            footnotes=(*footnotes, *((NEAR_LIMITS,) if widened else ())),
            compared=tuple(self._compared),
        )


# Starts of footnotes, without a full stop. Numbers of samples are of each seed.
def mean_over(seeds: int, samples: int) -> str:
    """Return that on means with the interval over their seeds."""
    none = f"with fewer than {LEAST_SEEDS} there is no interval and no bold"
    over = f"Mean over {plural(seeds, 'seed')}, {samples} test samples each"
    return f"{over}; {INTERVAL if seeds >= LEAST_SEEDS else none}"


def over_clusters(seeds: int | str, samples: int | str = "", clusters: str = FAMILIES) -> str:
    """Return that on values with intervals over seeds and clusters, which are named in the plural."""
    each = f", {samples} test samples each" if samples else ""
    return (
        f"Over {plural(seeds, 'seed')}{each}; in brackets: the 95 % interval of a bootstrap over {clusters} and seeds "
        f"({REPEATS} draws), for shares the farther bounds of it and of Wilson's interval (docs/comparison.md)"
    )


def cautious_over(seeds: int, samples: int) -> str:
    """Return that on means over seeds whose single answers are not kept (:func:`cautious_cell`)."""
    wilson = "Wilson's interval, for which a family of objects counts once in each seed (docs/comparison.md)"
    bounds = wilson if seeds < LEAST_SEEDS else f"the farther bounds of that and of {wilson}"
    over = mean_over(seeds, samples).replace("there is no", "all else has no")
    return f"{over}. In brackets, of accuracies, of which no single answers are kept: {bounds}"
