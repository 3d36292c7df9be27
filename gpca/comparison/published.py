"""The numbers that the paper prints (``published.csv``) and the reasons of misses (``reasons.csv``)."""

import csv
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

PUBLISHED = Path(__file__).with_name("published.csv")
HARDWARE = {"CPU": "Intel i7-12700K", "GPU": "NVIDIA RTX 3090"}  # of the paper's times (Sec. IV-E)
TEXT = "text"  # in the column `table`: the running text; its rows and columns are free
REASONS = PUBLISHED.with_name("reasons.csv")
NONE_YET = "no reason found yet"


class Unit(NamedTuple):
    """A unit as printed: factor from the unit of the results' files, least and largest possible value."""

    factor: float
    least: float = 0.0
    most: float = math.inf
    ratio: bool = False  # values are compared by their ratio, so an interval is one of the logarithm


UNITS = {
    "%": Unit(100, most=100),
    "labels": Unit(1, ratio=True),
    "epochs": Unit(1, ratio=True),
    "s": Unit(1, ratio=True),
    "ms": Unit(1000, ratio=True),
    "correlation": Unit(1, -1, 1),
    "risk": Unit(1, most=1, ratio=True),  # area under risk and coverage
    "share": Unit(1, most=1),
}
TIMES = ("s", "ms")
TITLES = {  # of the paper's tables, in words
    "I": "Single-concept attribution",
    "II": "Accuracy per concept",
    "III": "Active learning",
    "IV": "Kernel and schedule",
    "V": "Learners",
    "VI": "Backbones and reductions on depth frames",
    "VII": "Runtime",
    TEXT: "In the text",
}


def table_in_words(table: str) -> str:
    return TITLES[TEXT] if table == TEXT else f"Table {table}: {TITLES.get(table, '')}"


@dataclass(frozen=True)
class Counterpart:
    """The value of a run beside a printed number; ``runtime.csv`` has components, "model" and a device as concept."""

    file: str  # CSV file in ``results/{run}/``
    table: str
    sources: tuple[str, ...]  # averaged seed by seed
    methods: tuple[str, ...]  # summed
    metrics: tuple[str, ...]  # one, or dividend and divisor
    concept: str
    statistic: str  # over the seeds, mean or deviation


@dataclass(frozen=True)
class Number:
    """One printed number, or the range from `value` to `upper`, with `decimals` digits (-1: in tens)."""

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
    paper_n: int = 0  # samples of a share, or repeats of a standard deviation; 0 where unknown
    same_as: tuple[str, ...] = ()  # key of an earlier number that has the same counterpart

    @property
    def key(self) -> tuple[str, str, str]:
        """The table, row and column that name it."""
        return self.table, self.row, self.column

    @property
    def rounding(self) -> float:
        """Half of the last printed digit."""
        return 0.5 * 10.0**-self.decimals

    def text(self) -> str:
        """Return the number as printed, without its unit."""
        digits = max(self.decimals, 0)
        text = f"{self.value:.{digits}f}"
        return f"{text} to {self.upper:.{digits}f}" if self.upper > self.value else text


def read_published() -> list[Number]:
    """Return the printed numbers, in the order of the file; a test checks the rules of its columns."""
    return [
        Number(
            **{name: fields[name] for name in ("table", "row", "column", "unit", "device", "place", "note")},
            value=float(fields["value"]),
            upper=float(fields["upper"] or fields["value"]),
            decimals=int(fields["decimals"]),
            counterpart=Counterpart(
                *(fields["in_file"], fields["in_table"], tuple(fields["source"].split())),
                *(tuple(fields["method"].split("+")), tuple(fields["metric"].split("/"))),
                *(fields["concept"], fields["statistic"]),
            )
            if fields["in_file"]
            else None,
            paper_n=int(fields["paper_n"] or 0),
            same_as=tuple(filter(None, fields["same_as"].split(" / "))),
        )
        for fields in read_lines(PUBLISHED)
    ]


def printed_seconds(numbers: Iterable[Number]) -> dict[str, Number]:
    """Return component -> its time in Table VII, with `value` and `upper` in seconds."""
    return {
        n.counterpart.methods[0]: replace(n, value=n.value / f, upper=n.upper / f, unit="s")
        for n in numbers
        if n.table == "VII" and n.counterpart
        for f in [UNITS[n.unit].factor]
    }


def read_lines(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, strict=True))


class Reason(NamedTuple):
    """A reason and the numbers that it applies to; `*` in row and column stands for any text."""

    table: str
    row: str
    column: str
    text: str


def read_reasons() -> list[Reason]:
    return [Reason(*fields.values()) for fields in read_lines(REASONS)]


def reason_of(number: Number, reasons: Sequence[Reason]) -> str:
    fitting = (reason for reason in reasons if all(map(fnmatchcase, number.key, reason[:3])))
    return next((reason.text for reason in fitting), NONE_YET)
