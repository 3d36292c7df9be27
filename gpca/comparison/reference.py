"""Compares a run's CSV files with a reference run's: identical, within rounding, or different (docs/comparison.md)."""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, NamedTuple

from gpca.errors import InputError
from gpca.evaluation.intervals import mean_interval
from gpca.evaluation.measures import KEYS, TIDY_COLUMNS
from gpca.io.csv_file import ANY, finite_number, read_csv
from gpca.io.files import require_file
from gpca.jobs.provenance import read_record
from gpca.settings import Keys, NotNegative, Share

VERDICTS = IDENTICAL, ROUNDING, DIFFERENT, MISSING = "identical", "rounding", "different", "missing"
NOT_COMPARED = (  # made from times, which differ from run to run
    *("timings.csv", "runtime.csv", "tables/table7_runtime.csv"),
    *("comparison.csv", "claims.csv", "tables/claims.csv"),
)
LARGEST_BYTES = 3 * 10**7  # of a file of means, ten times the largest
REMEDY = "regenerate it"
KINDS = tuple(  # file, metric or column, kind of value; the first that fits
    (file, pattern, kind)
    for file, patterns, kind in (
        ("*", "*rho* spearman_error", "correlation"),
        ("*", "rotation_deg", "degrees"),
        ("*", "kl_* nne* nees* *nll* *elbo*", "nats"),
        ("tables/table12_*", "auroc_failed lead", "share"),
        ("*", "*labels* *epochs* *samples* *delay* *calls* *parameters* clusters predicted_as_*", "count"),
        ("*recovery.csv", "episodes tries nominal", "count"),
        ("tables/table5_*", "*aurc augrc brier", "share"),
        ("tables/*", "ece* nominal_calibration", "share"),
        ("tables/*", "*", "percent"),
        ("*", "*", "share"),
    )
    for pattern in patterns.split()
)
SAMPLE_COUNTS = ("test_samples", "episodes")  # metrics that count the samples of the other metrics' shares
SHARES_OF_RUNS = ("reached", "recognised")  # of the seeds' runs, not of the test samples


class Mean(NamedTuple):
    """A mean over the seeds."""

    value: float
    half_width: float  # of its 95 % interval; 0 where it has none
    quantity: str  # name of the metric or column
    samples: int = 0  # of all seeds, of which it is a share or a count; 0 where unknown
    unit: float = 0.0  # its change when all samples change: 1 for a share, 100 in percent, 0 if neither


OF_KINDS = Keys({kind: NotNegative for *_, kind in KINDS}, required=[kind for *_, kind in KINDS])


@dataclass(frozen=True)
class Allowance:
    """The largest difference allowed between two means: section ``reference`` of the config."""

    tolerances: Annotated[dict, OF_KINDS]
    half_widths: NotNegative  # multiple of those of the reference's 95 % intervals, for all but shares of samples
    flipped: Share  # share of the samples that another rounding may decide otherwise
    deviations: NotNegative  # number of standard deviations of the balance of flipped samples
    ratio: Share  # allowed share of a count of labels or epochs, as a target may be reached a step later

    def limit(self, file: str, mean: Mean) -> float:
        """Return the largest difference from a mean of the reference's file that rounding explains."""
        kind = kind_of(file, mean.quantity)
        allowed = self.tolerances[kind]
        if mean.samples and mean.unit:
            # Not its interval: that of a few seeds is wider than anything that the samples can explain.
            return max(allowed, mean.unit * self.deviations * math.sqrt(self.flipped / mean.samples))
        if kind == "count" and not mean.unit:
            allowed = max(allowed, self.ratio * abs(mean.value))
        return max(allowed, self.half_widths * mean.half_width)


class FileCheck(NamedTuple):
    """The outcome of the comparison of one file: one of `VERDICTS`, and the differences."""

    file: str
    verdict: str
    detail: str = ""


def check_reference(run: Path, reference: Path, allowance: Allowance) -> list[FileCheck]:
    """Compare every CSV file of means in the reference's folder with that of the run's."""
    files = [str(path.relative_to(reference)) for path in sorted(reference.rglob("*.csv"))]
    files = [file for file in files if file not in NOT_COMPARED]
    if not files:
        raise InputError(reference, "has no reference", "give the folder of a run that has one in results/reference")
    metrics = reference / "metrics.csv"
    means = read_means(metrics) if metrics.is_file() else {}
    samples = {key[1]: mean.samples for key, mean in means.items() if key[-1] == "all" and mean.samples}
    outcomes = []
    for file in files:
        if not (run / file).is_file():
            outcomes.append(FileCheck(file, MISSING))
            continue
        means_run, means_reference = (read_means(folder / file, samples) for folder in (run, reference))
        verdict, detail = _compared(file, means_run, means_reference, allowance)
        # Other settings explain differing values. The record names the whole config, so equal values stay identical.
        # A section that the reference's record lacks is newer than the reference.
        here, there = (read_record(folder / file).get("config_sha256") or {} for folder in (run, reference))
        changed = sorted(name for name, of in there.items() if here and here.get(name) != of)
        if changed and verdict != IDENTICAL:
            verdict, detail = DIFFERENT, f"{detail}; config differs in {', '.join(changed)}"
        outcomes.append(FileCheck(file, verdict, detail))
    return outcomes


def _compared(file: str, here: Mapping[tuple, Mean], there: Mapping[tuple, Mean], allowance: Allowance):
    for one, other, verb in ((there, here, "lacks"), (here, there, "adds to the reference")):
        if extra := [key for key in one if key not in other]:
            return DIFFERENT, f"{verb} {len(extra)} of {len(one)} values, such as {' / '.join(extra[0])}"
    pairs = {key: (here[key].value, mean.value) for key, mean in there.items()}
    differences = {key: x - y for key, (x, y) in pairs.items() if x != y and not (math.isnan(x) and math.isnan(y))}
    if not differences:
        return IDENTICAL, f"all {len(there)} values"
    limits = {key: allowance.limit(file, there[key]) for key in differences}
    excess = {key: abs(x) / limits[key] if limits[key] and x == x else math.inf for key, x in differences.items()}
    beyond = [key for key in differences if excess[key] > 1]
    worst = max(differences, key=lambda key: excess[key])
    mean, difference, limit = there[worst], differences[worst], limits[worst]
    largest = f"{difference:+.4g}, where {limit:.4g} is allowed"
    if mean.samples and mean.unit:
        flipped, expected = (x / mean.unit * mean.samples for x in (abs(difference), limit))
        largest += f" ({flipped:.0f} of {mean.samples} samples, where {expected:.0f} are expected at most)"
    counts = f"{len(differences)} of {len(there)} values differ"
    counts += f", {len(beyond)} by more than rounding explains" if beyond else ""
    return DIFFERENT if beyond else ROUNDING, f"{counts}; the worst, {' / '.join(worst)}: {largest}"


def device_of(folder: Path, file: str) -> str:
    """Return the processor that made a file, and the instruction level of its libraries."""
    device = read_record(folder / file).get("device", {})
    named = [device.get("name"), *(f"{name} {device[name]}" for name in ("family", "model") if device.get(name))]
    return ", ".join(filter(None, [*named, device.get("instructions")])) or "on an unrecorded processor"


def read_means(path: Path, samples_of_source: Mapping[str, int] = MappingProxyType({})) -> dict[tuple[str, ...], Mean]:
    """Return the means over the seeds in a tidy file or a table, without times."""
    require_file(path, "no such file", REMEDY, LARGEST_BYTES)
    table = read_csv(path, (), others=ANY)
    heads, rows, means = list(table), table.to_dict("records"), {}
    if tuple(heads) == TIDY_COLUMNS:
        if table.duplicated([*KEYS, "seed"]).any():
            raise InputError(path, "has a quantity of a seed twice", REMEDY)
        values: dict[tuple[str, ...], list[float]] = defaultdict(list)
        for row in rows:
            values[tuple(row[name] for name in KEYS)].append(finite_number(path, "value", row["value"]))
        for key, values_R in values.items():
            *place, quantity, concept = key
            if quantity in SAMPLE_COUNTS and min(values_R) < 0:
                raise InputError(path, f"'{quantity}' is negative", REMEDY)
            mean, low, _ = mean_interval(values_R)
            counts = [(*place, name, part) for name in SAMPLE_COUNTS for part in (concept, "all")]
            samples = next((sum(values[key]) for key in counts if key in values), samples_of_source.get(place[1], 0))
            half_width = 0.0 if math.isnan(low) else mean - low
            means[key] = _mean(path.name, mean, half_width, quantity, samples, len(values_R))
    elif "mean" in heads[1:]:
        # A column of yes and no is a result that follows from the means, not a label.
        labels = [name for name in heads[: heads.index("mean")] if not {row[name] for row in rows} <= {"yes", "no"}]
        seen: Counter = Counter()
        for row in rows:
            mean, low, high = (
                finite_number(path, name, row[name]) if row.get(name) else math.nan
                for name in ("mean", "ci_low", "ci_high")
            )
            half_width = 0.0 if math.isnan(low) or math.isnan(high) else max(mean - low, high - mean)
            samples, seeds = (finite_number(path, name, row.get(name) or "0") for name in ("n_test", "n_seeds"))
            if samples < 0 or seeds < 0:
                raise InputError(path, "counts fewer than no samples or seeds", REMEDY)
            key = tuple(row[name] for name in labels)
            seen[key] += 1
            further = (f"row {seen[key]} of these names",) if seen[key] > 1 else ()
            means[*key, *further] = _mean(f"tables/{path.name}", mean, half_width, key[-1], samples, int(seeds) or 1)
        if all(math.isnan(mean.value) for mean in means.values()):
            raise InputError(path, "has no mean at all", REMEDY)
    else:
        raise InputError(path, "is neither tidy metrics nor a table", REMEDY)
    return {key: mean for key, mean in means.items() if "seconds" not in mean.quantity}


@cache
def kind_of(file: str, quantity: str) -> str:
    return next(kind for files, names, kind in KINDS if fnmatchcase(file, files) and fnmatchcase(quantity, names))


def _mean(file: str, value: float, half_width: float, quantity: str, samples: float, seeds: int) -> Mean:
    samples = seeds if quantity in SHARES_OF_RUNS else samples
    unit = {"share": 1.0, "percent": 100.0}.get(kind_of(file, quantity), 0.0)
    if quantity.startswith("predicted_as_"):
        unit = samples / seeds
    return Mean(value, half_width, quantity, int(samples), unit)
