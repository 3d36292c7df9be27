"""The means over the seeds of a run's CSV files, and how many samples each is a share of."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType

from gpca.attribution.metrics import TIDY_COLUMNS as TIDY
from gpca.attribution.metrics import mean_interval
from gpca.errors import InputError
from gpca.io.csv_file import ANY, finite_number, read_csv

TIMES = "*seconds*"
# The kind of a value, by its file and its metric or column; the first that fits.
KINDS = (
    ("*", "*rho*", "correlation"),
    ("*", "rotation_deg", "degrees"),
    ("*", "spearman_error", "correlation"),
    *(("*", pattern, "nats") for pattern in ("kl_*", "nne*", "nees*")),
    *(("tables/table12_*", pattern, "share") for pattern in ("auroc_failed", "lead")),
    *(("*", pattern, "nats") for pattern in ("*nll*", "*elbo*")),
    *(("*", f"*{counted}*", "count") for counted in ("labels", "epochs", "samples", "delay", "calls", "parameters")),
    ("*", "clusters", "count"),
    *(("*", pattern, "count") for pattern in ("predicted_as_*", "first_*", "*_wrong")),
    *(("*recovery.csv", counted, "count") for counted in ("episodes", "tries", "acted_first", "actions", "nominal")),
    ("*recovery.csv", "failures_at_*", "count"),
    *(("tables/table5_*", pattern, "share") for pattern in ("*aurc", "augrc", "brier")),
    *(("tables/*", pattern, "share") for pattern in ("ece*", "nominal_calibration")),
    ("tables/*", "*", "percent"),
    ("*", "*", "share"),
)

COUNTS_OF_SAMPLES = ("test_samples", "episodes")  # metrics that say of how many samples the others are shares
OF_RUNS = ("reached", "recognised")  # shares of the seeds' runs, whatever the test samples
PARTS = ("predicted_as_*", "first_*", "acted_first")  # numbers of samples out of these


@dataclass(frozen=True)
class Mean:
    """A mean over the seeds.

    Attributes:
        value: the mean.
        half_width: of its 95 % interval; 0 where it has none.
        quantity: its name.
        samples: of how many samples, of all seeds, it is a share or a number; 0 where that is not told.
        unit: by how much it changes when all of them do: 1 for a share, 100 in percent, 0 if neither.
    """

    value: float
    half_width: float
    quantity: str
    samples: int = 0
    unit: float = 0.0


def read_means(path: Path, samples_of_source: Mapping[str, int] = MappingProxyType({})) -> dict[tuple[str, ...], Mean]:
    """Return a tidy file's means over the seeds, or a table's; times left out.

    Args:
        path: the file.
        samples_of_source: test samples of all seeds of a source, for tidy files that do not count them.

    Raises:
        InputError: empty, unreadable, neither tidy nor a table, something that is not a number.
    """
    table = read_csv(path, (), others=ANY)
    heads = list(table)
    rows = table.to_dict("records")
    if tuple(heads) == TIDY:
        means = _of_tidy(path, rows, samples_of_source)
    elif "mean" in heads[1:]:
        means = _of_table(path, rows, heads)
    else:
        raise InputError(path, "is neither tidy metrics nor a table", "regenerate it")
    return {key: mean for key, mean in means if not fnmatchcase(mean.quantity, TIMES)}


def kind_of(file: str, quantity: str) -> str:
    """Return the kind of a quantity in a file."""
    return next(
        kind for of_file, of_name, kind in KINDS if fnmatchcase(file, of_file) and fnmatchcase(quantity, of_name)
    )


def samples_of_sources(path: Path) -> dict[str, int]:
    """Return how many test samples of all seeds each source has, by the metrics of any explainer of it."""
    if not path.is_file():
        return {}
    return {key[1]: mean.samples for key, mean in read_means(path).items() if key[-1] == "all" and mean.samples}


def _of_tidy(
    path: Path, rows: list[dict], samples_of_source: Mapping[str, int]
) -> Iterator[tuple[tuple[str, ...], Mean]]:
    values: dict[tuple[str, ...], list[float]] = defaultdict(list)
    for row in rows:
        key = tuple(row[name] for name in ("table", "source", "method", "metric", "concept"))
        values[key].append(finite_number(path, "value", row["value"]))
    for (table, source, method, quantity, concept), values_R in values.items():
        mean, low, _ = mean_interval(values_R)
        counts = [(table, source, method, name, of) for name in COUNTS_OF_SAMPLES for of in (concept, "all")]
        counted = next((sum(values[key]) for key in counts if key in values), samples_of_source.get(source, 0))
        counted = len(values_R) if quantity in OF_RUNS else counted
        half_width = 0.0 if math.isnan(low) else mean - low
        unit = _unit(path.name, quantity, counted, len(values_R))
        yield (table, source, method, quantity, concept), Mean(mean, half_width, quantity, int(counted), unit)


def _of_table(path: Path, rows: list[dict], heads: list[str]) -> Iterator[tuple[tuple[str, ...], Mean]]:
    # What says yes or no is a result, and follows from the means.
    labels = [name for name in heads[: heads.index("mean")] if not {row[name] for row in rows} <= {"yes", "no"}]
    for row in rows:
        mean, low, high = (
            finite_number(path, name, row[name]) if row.get(name) else math.nan
            for name in ("mean", "ci_low", "ci_high")
        )
        half_width = 0.0 if math.isnan(low) or math.isnan(high) else max(mean - low, high - mean)
        quantity, samples = row[labels[-1]], finite_number(path, "n_test", row.get("n_test") or "0")
        samples = int(row.get("n_seeds") or 1) if quantity in OF_RUNS else samples
        unit = _unit(f"tables/{path.name}", quantity, samples, int(row.get("n_seeds") or 1))
        yield tuple(row[name] for name in labels), Mean(mean, half_width, quantity, int(samples), unit)


def _unit(file: str, quantity: str, samples: float, seeds: int) -> float:
    """Return by how much a quantity changes when all its samples do; 0 if it is no share and no number of them."""
    if any(fnmatchcase(quantity, pattern) for pattern in PARTS):
        return samples / seeds
    return {"share": 1.0, "percent": 100.0}.get(kind_of(file, quantity), 0.0)
