"""What the paper prints: every number of its tables and text, from ``published.csv`` (docs/comparison.md)."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from gpca.csv_file import finite_number
from gpca.errors import InputError
from gpca.numerals import whole

PUBLISHED = Path(__file__).with_name("published.csv")
HARDWARE = {"CPU": "Intel i7-12700K", "GPU": "NVIDIA RTX 3090"}  # on which the paper measured its times (Sec. IV-E)
TEXT = "text"  # stands for the running text in the column `table`; its rows and columns are free
FILES = ("metrics.csv", "timings.csv", "active_learning.csv", "kernels.csv", "diagnostics.csv", "real_world.csv",
         "runtime.csv", "recovery.csv")  # fmt: skip
STATISTICS = ("mean", "deviation")  # over the seeds
_COUNTERPART = ("in_file", "in_table", "source", "method", "metric", "concept", "statistic")
PUBLISHED_COLUMNS = (
    *("table", "row", "column", "value", "upper", "decimals", "paper_n", "unit", "device", "place"),
    *(*_COUNTERPART, "same_as", "note"),
)


@dataclass(frozen=True)
class Unit:
    """A unit as printed: factor from the unit of the results' files, least and largest possible value."""

    factor: float
    least: float = 0.0
    most: float = math.inf


UNITS = {
    "%": Unit(100, most=100),
    "labels": Unit(1),
    "epochs": Unit(1),
    "s": Unit(1),
    "ms": Unit(1000),
    "correlation": Unit(1, -1, 1),
    "risk": Unit(1, most=1),  # area under risk and coverage
    "share": Unit(1, most=1),
}
TIMES = ("s", "ms")
_SOURCES = ("Coffee Cup", "LINEMOD", "YCB")
_REDUCTIONS = ("No Reduction", "PCA", "UMAP", "AE")


@dataclass(frozen=True)
class PaperTable:
    """A table of the paper: what it shows, its rows and columns."""

    title: str
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()


TABLES = {
    "I": PaperTable("Single-concept attribution", _SOURCES, ("SHAP", "SA", "GP-CA")),
    "II": PaperTable("Accuracy per concept", _SOURCES, ("Noise", "Pose", "Overlap")),
    "III": PaperTable("Active learning", _SOURCES, ("#Labels BALD", "#Labels Random", "Acc.", "Epochs")),
    "IV": PaperTable(
        "Kernel and schedule",
        (
            "RBF, lr=.01, 100 iterations",
            "Matérn 3/2, lr=.01, 200 iterations",
            "Poly. p=2, lr=.01, 200 iterations",
            "RBF, lr=.001, 200 iterations",
            "Poly. p=2, lr=.001, 200 iterations",
        ),
        ("YCB", "LINEMOD"),
    ),
    "V": PaperTable("Learners", ("GPC", "RF", "Linear SVM"), ("CC", "LM", "YCB", "ρ", "AUC", "ECE")),
    "VI": PaperTable(
        "Backbones and reductions on depth frames",
        tuple(f"{b}, {r}" for b in ("DGCNN", "PointNet", "PointNet++", "PointNeXt") for r in _REDUCTIONS),
        ("Mean Acc.", "Std. Dev."),
    ),
    "VII": PaperTable(
        "Runtime",
        (
            "ICP alignment",
            "DGCNN feature extraction",
            "GPC posterior sampling (1000 draws)",
            "GP-CA score computation",
            "BALD selection (optional)",
            "GPC retraining (optional)",
        ),
        ("Time",),
    ),
    TEXT: PaperTable("In the text"),
}


@dataclass(frozen=True)
class Counterpart:
    """Which value of a run stands beside a printed number.

    Attributes:
        file: its CSV file in ``results/{run}/``.
        table: what `table` of its tidy rows reads; "components" for ``runtime.csv``.
        sources: their mean is taken, seed by seed; of ``runtime.csv`` "model", what the model was trained on.
        methods: their sum is taken.
        metrics: one, or two of which the first is divided by the second.
        concept: what `concept` of the tidy rows reads; the device for ``runtime.csv``.
        statistic: how the values over the seeds become one.
    """

    file: str
    table: str
    sources: tuple[str, ...]
    methods: tuple[str, ...]
    metrics: tuple[str, ...]
    concept: str
    statistic: str


@dataclass(frozen=True)
class Number:
    """One printed number, or the range from `value` to `upper`, with `decimals` digits (-1: in tens).

    Attributes:
        paper_n: of how many samples it is a share, or of how many repeats a standard deviation; 0 where that cannot be
            told.
        same_as: key of an earlier number beside which the suite sets the same value of its own.
    """

    table: str
    row: str
    column: str
    value: float
    upper: float
    decimals: int
    unit: str
    device: str
    place: str
    counterpart: Counterpart | None
    note: str
    paper_n: int = 0
    same_as: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[str, str, str]:
        """What names it: table, row and column."""
        return self.table, self.row, self.column

    @property
    def rounding(self) -> float:
        """Half of the last printed digit."""
        return 0.5 * 10.0**-self.decimals

    def text(self) -> str:
        """Return the number as printed, without its unit."""
        digits = max(self.decimals, 0)
        if self.upper > self.value:
            return f"{self.value:.{digits}f} to {self.upper:.{digits}f}"
        return f"{self.value:.{digits}f}"


def read_published(path: str | Path = PUBLISHED) -> list[Number]:
    """Read the printed numbers, in the order of the file.

    Raises:
        InputError: missing or unreadable file, wrong columns, unknown table, row, column, unit, file or statistic,
            something that is not a number, a range upside down, more digits than `decimals`, a share that none of
            `paper_n` samples rounds to, half a counterpart, none and no note, the same cell twice, `same_as` of none
            above. It names the line.
    """
    numbers: list[Number] = []
    first: dict[tuple[str, str, str], int] = {}
    for line, fields in read_lines(path, PUBLISHED_COLUMNS):
        where = f"{path}, line {line}"
        number = _number(where, fields)
        if number.key in first:
            raise InputError(where, f"repeats {_named(number.key)}", f"it is on line {first[number.key]}")
        if number.same_as and number.same_as not in first:
            raise InputError(
                where, f"'same_as' {_named(number.same_as)} is not a number above", "name one of this file"
            )
        first[number.key] = line
        numbers.append(number)
    if not numbers:
        raise InputError(path, "has no numbers", "restore it")
    return numbers


def printed_seconds(numbers: Iterable[Number]) -> dict[str, Number]:
    """Return component -> its time in Table VII, with `value` and `upper` in seconds."""
    from dataclasses import replace

    return {
        n.counterpart.methods[0]: replace(n, value=n.value / f, upper=n.upper / f, unit="s")
        for n in numbers
        if n.table == "VII" and n.counterpart
        for f in [UNITS[n.unit].factor]
    }


def read_lines(path: str | Path, columns: Sequence[str]) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the number of each line of a CSV file, and its fields without the spaces around them.

    Raises:
        InputError: missing or unreadable file, other columns, more or fewer fields than columns.
    """
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            reader = csv.reader(file, strict=True)
            if tuple(next(reader, ())) != tuple(columns):
                raise InputError(f"{path}, line 1", "has other columns", f"they must be {','.join(columns)}")
            for fields in reader:
                if len(fields) != len(columns):
                    fault = f"has {len(fields)} fields for {len(columns)} columns"
                    raise InputError(f"{path}, line {reader.line_num}", fault, "quote text that contains a comma")
                yield reader.line_num, {name: field.strip() for name, field in zip(columns, fields, strict=True)}
    except FileNotFoundError:
        raise InputError(path, "no such file", "restore it") from None
    except (UnicodeDecodeError, csv.Error, IsADirectoryError) as fault:
        raise InputError(path, f"is not a readable CSV file: {fault}", "restore it") from fault


def _number(where: str, fields: dict[str, str]) -> Number:
    table = require_known(where, "table", fields["table"], TABLES)
    if table != TEXT:
        require_known(where, "row", fields["row"], TABLES[table].rows)
        require_known(where, "column", fields["column"], TABLES[table].columns)
    for name in ("row", "column", "place"):
        if not fields[name]:
            raise InputError(where, f"'{name}' is empty", "fill it in")
    require_known(where, "unit", fields["unit"], UNITS)
    remedy = "give one"
    value = finite_number(where, "value", fields["value"], remedy)
    upper = finite_number(where, "upper", fields["upper"], remedy) if fields["upper"] else value
    decimals = _whole(where, "decimals", fields["decimals"])
    paper_n = _whole(where, "paper_n", fields["paper_n"] or "0", least=0)
    if upper < value:
        raise InputError(where, f"'upper' {upper:g} is below 'value' {value:g}", "swap them")
    if any(round(bound, decimals) != bound for bound in (value, upper)):
        raise InputError(where, f"has a value with more than {decimals} decimals", "correct one of them")
    if paper_n and fields["unit"] == "%" and fields["statistic"] == "mean":
        nearest = 100 * round(value / 100 * paper_n) / paper_n
        if abs(nearest - value) > 0.5 * 10.0**-decimals + 1e-9:
            raise InputError(where, f"no share of {paper_n} samples rounds to {value:g} %", "correct 'paper_n'")
    return Number(
        **{name: fields[name] for name in ("table", "row", "column", "unit", "device", "place", "note")},
        value=value,
        upper=upper,
        decimals=decimals,
        counterpart=_counterpart(where, fields),
        paper_n=paper_n,
        same_as=tuple(filter(None, fields["same_as"].split(" / "))),
    )


def _whole(where: str, name: str, text: str, least: int = -9) -> int:
    try:
        return whole(text, least)
    except ValueError as fault:
        raise InputError(where, f"'{name}' is '{text}'", "give a whole number") from fault


def _counterpart(where: str, fields: dict[str, str]) -> Counterpart | None:
    given = [name for name in _COUNTERPART if fields[name]]
    if not given:
        if not fields["note"]:
            raise InputError(where, "has neither a counterpart nor a note that explains why", "give one")
        return None
    if len(given) < len(_COUNTERPART):
        empty = next(name for name in _COUNTERPART if not fields[name])
        raise InputError(where, f"names a counterpart, but '{empty}' is empty", "fill in all of it or none")
    require_known(where, "in_file", fields["in_file"], FILES)
    require_known(where, "statistic", fields["statistic"], STATISTICS)
    metrics = tuple(fields["metric"].split("/"))
    if len(metrics) > 2 or not all(metrics):
        raise InputError(where, f"'metric' is '{fields['metric']}'", "give one metric, or one divided by another")
    return Counterpart(
        fields["in_file"],
        fields["in_table"],
        tuple(fields["source"].split()),
        tuple(fields["method"].split("+")),
        metrics,
        fields["concept"],
        fields["statistic"],
    )


def require_known(where: str, name: str, given: str, known: Iterable[str]) -> str:
    """Return what was given, or raise an InputError that lists what is known."""
    if given not in known:
        raise InputError(where, f"unknown {name} '{given}'", f"expected one of {', '.join(known)}")
    return given


def _named(key: tuple[str, ...]) -> str:
    return " / ".join(key)
