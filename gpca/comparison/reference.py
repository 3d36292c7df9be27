"""Whether a run's numbers agree with a reference run's: CSV by CSV, within stated tolerances (docs/comparison.md)."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from gpca.attribution.metrics import TIDY_COLUMNS as TIDY
from gpca.attribution.metrics import mean_interval
from gpca.errors import InputError
from gpca.files import read_csv

# What differs from run to run, and what is made of it: never compared.
NOT_COMPARED = ("timings.csv", "runtime.csv", "tables/table7_runtime.csv", "comparison.csv")
TIMES = "*seconds*"
# What kind a value is of, by its file and its metric or column; the first that fits.
KINDS = (
    ("*", "*rho*", "correlation"),
    *(("*", pattern, "nats") for pattern in ("*nll*", "*elbo*")),
    *(("*", f"*{counted}*", "count") for counted in ("labels", "epochs", "samples", "delay", "calls", "parameters")),
    *(("*", pattern, "count") for pattern in ("predicted_as_*", "first_*")),
    *(("*recovery.csv", counted, "count") for counted in ("episodes", "tries", "acted_first", "actions")),
    *(("tables/table5_*", pattern, "share") for pattern in ("*aurc", "augrc", "ece*", "brier")),
    ("tables/*", "*", "percent"),
    ("*", "*", "share"),
)


@dataclass(frozen=True)
class Mean:
    """A mean over the seeds, the half-width of its 95 % interval (0 where it has none), the name of its quantity."""

    value: float
    half_width: float
    quantity: str


@dataclass(frozen=True)
class FileCheck:
    """What the comparison of one file came to: "agrees", "differs" or "missing", and the largest difference."""

    file: str
    verdict: str
    detail: str = ""


def check_reference(run: Path, reference: Path, tolerances: Mapping[str, float], half_widths: float) -> list[FileCheck]:
    """Compare every CSV file of means that the reference has.

    Args:
        run, reference: folders.
        tolerances: the largest difference of two means, for each kind in `KINDS`.
        half_widths: a mean may also differ by so many half-widths of the reference's 95 % interval.

    Raises:
        InputError: no reference, none of its files a CSV, one made by another config, a file that cannot be read.
    """
    files = [str(path.relative_to(reference)) for path in sorted(reference.rglob("*.csv"))]
    files = [file for file in files if file not in NOT_COMPARED]
    if not files:
        raise InputError(reference, "holds no reference", "give the folder of a run that has one in results/reference")
    require_same_config(run, reference, files)
    outcomes = []
    for file in files:
        if (run / file).is_file():
            outcomes.append(
                _compared(file, read_means(run / file), read_means(reference / file), tolerances, half_widths)
            )
        else:
            outcomes.append(FileCheck(file, "missing"))
    return outcomes


def require_same_config(run: Path, reference: Path, files: list[str]) -> None:
    """Raise an InputError for the first file whose provenance names another config than the reference's."""
    for file in files:
        here, there = (_config_of(folder / f"{file}.provenance.json") for folder in (run, reference))
        if here and there and here != there:
            fault = f"{file} was made by another config than {run / file}"
            raise InputError(reference, fault, "compare a run of that config, or make the reference anew")


def read_means(path: Path) -> dict[tuple[str, ...], Mean]:
    """Return a tidy file's means over the seeds, or a table's; times left out.

    Raises:
        InputError: empty, unreadable, neither tidy nor a table, something that is not a number.
    """
    table = read_csv(path, ())
    heads = list(table)
    rows = table.to_dict("records")
    if tuple(heads) == TIDY:
        means = _of_tidy(path, rows)
    elif "mean" in heads[1:]:
        means = _of_table(path, rows, heads)
    else:
        raise InputError(path, "is neither tidy metrics nor a table", "make it anew")
    return {key: mean for key, mean in means if not fnmatchcase(mean.quantity, TIMES)}


def kind_of(file: str, quantity: str) -> str:
    """Return what kind a quantity of a file is of."""
    return next(
        kind for of_file, of_name, kind in KINDS if fnmatchcase(file, of_file) and fnmatchcase(quantity, of_name)
    )


def _compared(file: str, here: Mapping, there: Mapping, tolerances: Mapping, half_widths: float) -> FileCheck:
    for one, other, told in ((there, here, "lacks"), (here, there, "has beyond the reference")):
        if beyond := [key for key in one if key not in other]:
            return FileCheck(file, "differs", f"{told} {len(beyond)} of {len(one)} values, such as {_named(beyond[0])}")
    worst, detail = 0.0, f"all {len(there)} values are the same"
    for key, mean in there.items():
        kind = kind_of(file, mean.quantity)
        if kind not in tolerances:
            raise InputError("config key reference.tolerances", f"no kind '{kind}'", "give its tolerance")
        allowed = max(tolerances[kind], half_widths * mean.half_width)
        difference = here[key].value - mean.value
        excess = abs(difference) / allowed if allowed else (math.inf if difference else 0.0)
        if excess > worst:
            worst = excess
            detail = f"largest difference {difference:+.4g} where {allowed:.4g} is allowed ({kind}), at {_named(key)}"
    return FileCheck(file, "differs" if worst > 1 else "agrees", detail)


def _of_tidy(path: Path, rows: list[dict]) -> Iterator[tuple[tuple[str, ...], Mean]]:
    values = defaultdict(list)
    for row in rows:
        key = tuple(row[name] for name in ("table", "source", "method", "metric", "concept"))
        values[key].append(_finite(path, row["value"]))
    for key, values_R in values.items():
        mean, low, _ = mean_interval(values_R)
        yield key, Mean(mean, 0.0 if math.isnan(low) else mean - low, key[3])


def _of_table(path: Path, rows: list[dict], heads: list[str]) -> Iterator[tuple[tuple[str, ...], Mean]]:
    labels = heads[: heads.index("mean")]
    for row in rows:
        mean, low, high = (
            _finite(path, row[name]) if row.get(name) else math.nan for name in ("mean", "ci_low", "ci_high")
        )
        half_width = 0.0 if math.isnan(low) or math.isnan(high) else max(mean - low, high - mean)
        yield tuple(row[name] for name in labels), Mean(mean, half_width, row[labels[-1]])


def _finite(path: Path, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(path, f"holds '{text}' in place of a number", "make it anew")
    return value


def _config_of(path: Path) -> str | None:
    if not path.is_file():
        return None
    try:
        return json.loads(path.read_text(encoding="utf-8")).get("config_sha256")
    except (ValueError, AttributeError) as fault:
        raise InputError(path, "is no provenance record", "make its result anew") from fault


def _named(key: tuple[str, ...]) -> str:
    return " / ".join(key)
