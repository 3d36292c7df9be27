"""What the paper says in sentences, and which comparison of a run's values each stands for: ``claims.yaml``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from gpca.comparison.published import FILES, UNITS, Counterpart, require_known
from gpca.errors import InputError
from gpca.structured_text import load_own_yaml

CLAIMS = Path(__file__).with_name("claims.yaml")
TESTS = ("greater", "less", "not_worse", "equivalent")
PREDICTIONS = "predictions"  # stands for a file: the calibration that is computed from predictions
_TOLD = ("name", "sentence", "place")
_TESTED = ("test", "margin", "unit", "of", "comparisons")
_PLACES = ("in_file", "in_table", "source", "method", "metric", "concept")


@dataclass(frozen=True)
class Compared:
    """Two values that a claim compares; a number stands for itself, in the claim's unit."""

    one: Counterpart | float
    other: Counterpart | float

    @property
    def counterparts(self) -> list[Counterpart]:
        """Return those of the two that a run has to provide."""
        return [value for value in (self.one, self.other) if isinstance(value, Counterpart)]


@dataclass(frozen=True)
class Claim:
    """A sentence.

    Attributes:
        test: one of `TESTS`.
        margin: the smallest difference that counts, in `unit`; with `ratio`, a factor.
        compared: what has to hold for all; empty where nothing was run, and then `note` says why.
    """

    name: str
    sentence: str
    place: str
    test: str = ""
    margin: float = 0.0
    unit: str = ""
    ratio: bool = False
    compared: tuple[Compared, ...] = ()
    note: str = ""


def read_claims(path: str | Path = CLAIMS) -> list[Claim]:
    """Read the claims, in the order of the file.

    Raises:
        InputError: no list of claims, a key that is missing or unknown, a name that stands twice, an unknown test,
            unit or file, a margin that is no distance, an incomplete place. It names the claim.
    """
    entries = load_own_yaml(Path(path))
    if not isinstance(entries, list) or not entries:
        raise InputError(path, "has no claims", "restore it")
    claims: list[Claim] = []
    for number, entry in enumerate(entries, start=1):
        if not isinstance(entry, Mapping) or not isinstance(entry.get("name"), str):
            raise InputError(path, f"claim {number} has no name", "give one")
        where = f"{path}, claim {entry['name']}"
        if any(claim.name == entry["name"] for claim in claims):
            raise InputError(where, "appears twice", "rename one of them")
        claims.append(_claim(where, entry))
    return claims


def _claim(where: str, entry: Mapping) -> Claim:
    required = (*_TOLD, "note") if "comparisons" not in entry else (*_TOLD, *_TESTED)
    if missing := [name for name in required if name not in entry]:
        raise InputError(where, f"lacks '{missing[0]}'", "add it")
    if unknown := set(entry) - {*required, "ratio"}:
        raise InputError(where, f"unknown key '{min(unknown)}'", f"use only {', '.join(required)}, ratio")
    told = {name: entry[name] for name in _TOLD}
    if "comparisons" not in entry:
        return Claim(**told, note=entry["note"])
    require_known(where, "test", entry["test"], TESTS)
    require_known(where, "unit", entry["unit"], UNITS)
    ratio = entry.get("ratio", False)
    least = 1 if ratio else 0
    if not isinstance(entry["margin"], int | float) or not least <= entry["margin"] < math.inf:
        raise InputError(where, f"'margin' is '{entry['margin']}'", f"give a number of at least {least}")
    compared = tuple(pair for comparison in entry["comparisons"] for pair in _pairs(where, entry["of"], comparison))
    return Claim(**told, test=entry["test"], margin=entry["margin"], unit=entry["unit"], ratio=ratio, compared=compared)


def _pairs(where: str, of: Mapping, comparison: Mapping) -> Iterator[Compared]:
    """Yield every pair of one comparison, by source and table."""
    if set(comparison) != {"one", "others"}:
        raise InputError(
            where, f"has a comparison with the keys {', '.join(comparison)}", "give it the keys one and others"
        )
    sources, tables = (_listed(of.get(name)) for name in ("source", "in_table"))
    for other, source, table in product(comparison["others"], sources, tables):
        place = {**of, "source": source, "in_table": table}
        yield Compared(_value(where, place, comparison["one"]), _value(where, place, other))


def _value(where: str, place: Mapping, own: str | float | Mapping) -> Counterpart | float:
    if isinstance(own, int | float):
        return float(own)
    full = {**place, **(own if isinstance(own, Mapping) else {"method": own})}
    if set(full) != set(_PLACES) or not all(isinstance(text, str) and text for text in full.values()):
        raise InputError(where, f"has a value at {full}", f"name its {', '.join(_PLACES)}")
    require_known(where, "in_file", full["in_file"], (*FILES, PREDICTIONS))
    return Counterpart(
        full["in_file"],
        full["in_table"],
        (full["source"],),
        tuple(full["method"].split("+")),
        tuple(full["metric"].split("/")),
        full["concept"],
        "mean",
    )


def _listed(given: object) -> list:
    return list(given) if isinstance(given, list) else [given]
