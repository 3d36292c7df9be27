"""Compares a run's numbers with a reference run's, CSV by CSV: equal to the byte, within rounding, or different.

Other libraries, or a processor below the common level, round otherwise. A trained encoder then decides some samples
otherwise: of n samples on which the two runs differ with probability d, the difference of two shares has the standard
deviation √(d / n), so the allowed difference follows from n (docs/comparison.md). Every value is judged by itself: one
that differs by more makes its file different, however many agree.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from gpca.comparison.means import KINDS, Mean, kind_of, read_means, samples_of_sources
from gpca.errors import InputError
from gpca.settings import Keys, NotNegative, Share

VERDICTS = IDENTICAL, ROUNDING, DIFFERENT, MISSING = "identical", "rounding", "different", "missing"
# These differ from run to run, or are made from files that do, and are never compared.
NOT_COMPARED = (
    *("timings.csv", "runtime.csv", "tables/table7_runtime.csv", "tables/table10_costs.csv"),
    *("comparison.csv", "claims.csv", "tables/claims.csv"),
)


@dataclass(frozen=True)
class Allowance:
    """The largest difference allowed between two means: section ``reference`` of the config.

    Attributes:
        tolerances: the largest difference, for each kind in :data:`gpca.comparison.means.KINDS`.
        flipped: for shares of samples, the share of samples that another rounding may decide otherwise,
        deviations: and the number of standard deviations of their balance that are allowed.
        half_widths: for all else, the number of half-widths of the reference's 95 % interval that are allowed.
        ratio: the share of a number of labels or epochs that is allowed, as a target may be reached a step later.
    """

    tolerances: Annotated[dict, Keys({kind: NotNegative for *_, kind in KINDS}, required=[kind for *_, kind in KINDS])]
    half_widths: NotNegative
    flipped: Share
    deviations: NotNegative
    ratio: Share

    def of(self, file: str, mean: Mean) -> float:
        """Return the largest difference from a mean of the reference's file that rounding explains."""
        kind = kind_of(file, mean.quantity)
        allowed = self.tolerances[kind]
        if mean.samples and mean.unit:
            # Not its interval: that of a few seeds is wider than anything that the samples can explain.
            return max(allowed, mean.unit * self.deviations * math.sqrt(self.flipped / mean.samples))
        if kind == "count" and not mean.unit:
            allowed = max(allowed, self.ratio * abs(mean.value))
        return max(allowed, self.half_widths * mean.half_width)


@dataclass(frozen=True)
class FileCheck:
    """The outcome of the comparison of one file: one of `VERDICTS`, and the differences."""

    file: str
    verdict: str
    detail: str = ""


def check_reference(run: Path, reference: Path, allowance: Allowance) -> list[FileCheck]:
    """Compare every CSV file of means that the reference has.

    Args:
        run, reference: folders.
        allowance: the differences that rounding explains.

    Raises:
        InputError: no reference, none of its files a CSV, a file that cannot be read.
    """
    files = [str(path.relative_to(reference)) for path in sorted(reference.rglob("*.csv"))]
    files = [file for file in files if file not in NOT_COMPARED]
    if not files:
        raise InputError(reference, "has no reference", "give the folder of a run that has one in results/reference")
    samples = samples_of_sources(reference / "metrics.csv")
    outcomes = []
    for file in files:
        if (run / file).is_file():
            here, there = (read_means(folder / file, samples) for folder in (run, reference))
            outcomes.append(_of_config(_compared(file, here, there, allowance), run, reference))
        else:
            outcomes.append(FileCheck(file, MISSING))
    return outcomes


def _of_config(outcome: FileCheck, run: Path, reference: Path) -> FileCheck:
    """Return the outcome, which other settings explain where values differ: then it is no matter of rounding.

    Equal values stay `IDENTICAL`, since the record names the whole config, also sections that the file does not depend
    on. A section that the reference's record does not name is newer than the reference.
    """
    records = (_record(folder / f"{outcome.file}.provenance.json") for folder in (run, reference))
    here, there = (record.get("config_sha256") or {} for record in records)
    others = sorted(section for section in there if here and here.get(section) != there[section])
    if outcome.verdict == IDENTICAL or not others:
        return outcome
    return FileCheck(outcome.file, DIFFERENT, f"{outcome.detail}; config differs in {', '.join(others)}")


def _compared(file: str, here: Mapping[tuple, Mean], there: Mapping[tuple, Mean], allowance: Allowance) -> FileCheck:
    for one, other, verb in ((there, here, "lacks"), (here, there, "adds to the reference")):
        if beyond := [key for key in one if key not in other]:
            return FileCheck(file, DIFFERENT, f"{verb} {len(beyond)} of {len(one)} values, such as {_named(beyond[0])}")
    differing = [key for key in there if here[key].value != there[key].value]
    if not differing:
        return FileCheck(file, IDENTICAL, f"all {len(there)} values")
    excess = {key: _excess(here[key].value - there[key].value, allowance.of(file, there[key])) for key in differing}
    beyond = [key for key in differing if excess[key] > 1]
    worst = max(differing, key=lambda key: excess[key])
    largest = _difference(here[worst].value - there[worst].value, allowance.of(file, there[worst]), there[worst])
    counts = f"{len(differing)} of {len(there)} values differ"
    if beyond:
        counts = f"{counts}, {len(beyond)} by more than rounding explains"
    return FileCheck(file, DIFFERENT if beyond else ROUNDING, f"{counts}; the worst, {_named(worst)}: {largest}")


def _excess(difference: float, allowed: float) -> float:
    return abs(difference) / allowed if allowed else math.inf


def _difference(difference: float, allowed: float, mean: Mean) -> str:
    """A difference and what is allowed, in samples where it is a share of them."""
    detail = f"{difference:+.4g}, where {allowed:.4g} is allowed"
    if not (mean.samples and mean.unit):
        return detail
    flipped, expected = (x / mean.unit * mean.samples for x in (abs(difference), allowed))
    return f"{detail} ({flipped:.0f} of {mean.samples} samples, where {expected:.0f} are expected at most)"


def device_of(folder: Path, file: str) -> str:
    """Return the processor that a file was made on, and the level of instructions that its libraries were held to."""
    device = _record(folder / f"{file}.provenance.json").get("device", {})
    known = [device.get("name"), *(f"{name} {device[name]}" for name in ("family", "model") if device.get(name))]
    return ", ".join(filter(None, [*known, device.get("instructions")])) or "on an unrecorded processor"


def _record(path: Path) -> dict:
    """Return a record of provenance, or an empty one where there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _named(key: tuple[str, ...]) -> str:
    return " / ".join(key)
