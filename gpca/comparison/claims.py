"""The paper's claims in sentences, and the comparison of a run's values that each stands for: ``claims.yaml``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from gpca.comparison.published import Counterpart
from gpca.io.structured_text import load_own_yaml

CLAIMS = Path(__file__).with_name("claims.yaml")
PREDICTIONS = "predictions"  # stands for a file: the calibration that is computed from predictions
FIRST_SET = "2026-11-22"  # a day after the first reference on real objects, which had shown the differences
Value = str | float | Mapping  # a method, a number, or what differs from the rest of the place


@dataclass(frozen=True)
class Compared:
    """Two values that a claim compares; a number stands for itself, in the claim's unit."""

    one: Counterpart | float
    other: Counterpart | float

    @property
    def counterparts(self) -> list[Counterpart]:
        """Return those of the two values that a run has to provide."""
        return [value for value in (self.one, self.other) if isinstance(value, Counterpart)]


@dataclass(frozen=True)
class Claim:
    """A claim of the paper in one sentence.

    Attributes:
        test: greater, less, not_worse or equivalent.
        margin: the smallest difference that counts, in `unit`; with `ratio`, a factor.
        margin_set: the day on which the margin entered git.
        values_known: whether the differences that it judges had been seen by then.
        compared: the comparisons, all of which have to hold; empty where nothing was run, and then `note` says why.
    """

    name: str
    sentence: str
    place: str
    test: str = ""
    margin: float = 0.0
    unit: str = ""
    ratio: bool = False
    margin_set: str = FIRST_SET
    values_known: bool = True
    compared: tuple[Compared, ...] = ()
    note: str = ""


def read_claims() -> list[Claim]:
    """Return the claims, in the order of the file; a test holds it to what its head says."""
    return [_claim(entry) for entry in load_own_yaml(CLAIMS)]


def counterparts_of(claims: Iterable[Claim]) -> list[Counterpart]:
    """Return all values of a run that the claims compare."""
    return [place for claim in claims for compared in claim.compared for place in compared.counterparts]


def _claim(entry: Mapping) -> Claim:
    compared = tuple(pair for comparison in entry.get("comparisons", ()) for pair in _pairs(entry["of"], **comparison))
    return Claim(**{name: entry[name] for name in entry if name not in ("of", "comparisons")}, compared=compared)


def _pairs(of: Mapping, one: Value, others: Sequence[Value]) -> Iterator[Compared]:
    """Yield every pair of one comparison, by source and table."""
    sources, tables = (_listed(of.get(name)) for name in ("source", "in_table"))
    for other, source, table in product(others, sources, tables):
        place = {**of, "source": source, "in_table": table}
        yield Compared(_value(place, one), _value(place, other))


def _value(place: Mapping, own: Value) -> Counterpart | float:
    if isinstance(own, int | float):
        return float(own)
    full = {**place, **(own if isinstance(own, Mapping) else {"method": own})}
    return Counterpart(
        full["in_file"],
        full["in_table"],
        (full["source"],),
        tuple(full["method"].split("+")),
        tuple(full["metric"].split("/")),
        full["concept"],
        "mean",
    )


def _listed(entry: object) -> list:
    return entry if isinstance(entry, list) else [entry]
