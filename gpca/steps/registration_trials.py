"""Step ``register_methods``: the test pairs of registrations, registered by every method.

Local methods start twice: at the pair's initial pose, and at the pose of a global method.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import numpy as np

from gpca.alignment.features import NEIGHBORS
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method, method_entry, require_global
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.judge import Judges
from gpca.pairs.perturbation import SEVERITIES
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds

if TYPE_CHECKING:
    import pandas as pd

INITIAL, NO_START = "initial", "none"  # where a registration starts; else, the name of a global method
SEVERITY_COLUMNS = tuple(f"severity_{name}" for name in SEVERITIES)
Method = Callable[[Pair], Outcome]
Points = Annotated[int, Bounds(minimum=64, maximum=65536)]


@dataclass(frozen=True)
class PairSettings:
    """The pairs that every method registers.

    Attributes:
        samples: test samples of each source and seed, balanced, at most.
        points: of source and of target (fewer where a cloud has fewer).
        global_start: the global method at whose pose local methods start a second time.
        points_of: method -> its own number of points, where its authors use more than others do.
        neighbors_of: method -> number of neighbors for its normals, where it is not the usual one.
    """

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]
    points: Points
    global_start: str
    points_of: dict[str, Points] = field(default_factory=dict)
    neighbors_of: dict[str, Annotated[int, Bounds(minimum=3, maximum=1000)]] = field(default_factory=dict)


def run(job: Job) -> None:
    """Register by every method, seed by seed; the one that gives the others a start runs in any case."""
    settings = PairSettings(**job.section("method_pairs"))
    start = [settings.global_start] if settings.global_start in job.section("methods") else []
    methods = job.by_name("methods", dict.fromkeys([*job.methods, *start]))
    objects = ObjectClouds.load(job.objects, job.source)
    for i, (seed, path) in enumerate(job.per_seed("registrations")):
        of_seed = slice(i, None, len(job.seeds))
        outputs = job.rows[of_seed], job.timings[of_seed]
        inputs = [job.objects, path]
        with record_provenance([*outputs[0], *outputs[1]], inputs, job.settings, seed=seed):
            registrations = Registrations.load(path, (job.source, seed))
            trials = try_methods(registrations, objects, job.source, seed, methods, settings)
            for name, out, timings in zip(job.methods, *outputs, strict=True):
                rows = trials[name]
                write_csv(out, rows.drop(columns="seconds"))
                write_csv(timings, rows[["sample", "start", "seconds"]])


def try_methods(
    registrations: Registrations,
    objects: ObjectClouds,
    source: str,
    seed: int,
    methods: Mapping[str, Mapping],
    settings: PairSettings,
) -> dict[str, pd.DataFrame]:
    """Return for each method a row per pair and start, with the points that it had and the seconds that it took.

    A method that fails has its reason in the row. Normals are estimated beforehand, as the same ones serve all methods
    of one number of points; what a method loads or compiles at its first call is loaded before the first pair. Fewer
    points of a cloud are among more of it.
    """
    import pandas as pd

    made = {name: make_method(name, entry) for name, entry in methods.items()}
    start = settings.global_start
    require_global(start)
    if start not in made:
        raise InputError("method_pairs.global_start", f"'{start}' is not among the methods", "add it or name another")
    rows = np.flatnonzero((registrations.split == "test") & (registrations.sample < settings.samples)).tolist()
    if not rows:  # threes of one object, which go round the objects
        raise InputError(f"registrations of {source}", "have no test samples", "raise registrations.test")
    of_objects = Judges(objects, f"objects of {source}")
    judges = [of_objects.of(registrations, row) for row in rows]
    given = lru_cache(maxsize=4)(lambda *of: pair_to_register(registrations, of[0], source, seed, *of[1:]))

    def pair_of(row: int, name: str) -> Pair:
        points, neighbors = settings.points_of.get(name, settings.points), settings.neighbors_of.get(name, NEIGHBORS)
        return given(row, points, neighbors)

    for name, method in made.items():
        method(pair_of(rows[0], name))
    records: dict[str, list[dict]] = {name: [] for name in made}
    for i, row in enumerate(progress(rows, f"registration methods on {source}, seed {seed}")):
        T_true = registrations.T_target_source("true", row)
        judge = judges[i]
        known = {
            "sample": registrations.sample[row],
            "object": registrations.object_name[row],
            "concept": registrations.concept[row],
            **{name: getattr(registrations, name)[row] for name in SEVERITY_COLUMNS},
            "symmetric": judge.symmetric,
        }
        coarse = timed(made[start], pair_of(row, start))
        for name, method in made.items():
            pair = pair_of(row, name)
            known_of_pair = known | {"points": (len(pair.source) + len(pair.target)) / 2}
            for started_at, outcome, seconds in attempts(name, method, pair, start, coarse):
                errors = judge(outcome.T_target_source, T_true)
                of_outcome = {key: getattr(outcome, key) for key in ("fitness", "inlier_rmse", "failure")}
                row_of_trial = known_of_pair | {"start": started_at} | errors | of_outcome
                records[name].append(row_of_trial | {"seconds": seconds})
    return {name: pd.DataFrame(of_method) for name, of_method in records.items()}


def pair_to_register(
    registrations: Registrations, row: int, source: str, seed: int, points: int, neighbors: int = NEIGHBORS
) -> Pair:
    """Return the input of a method for a registration: clouds thinned to `points`, normals estimated on these."""
    axes = (source, seed, "methods", registrations.split[row], registrations.sample[row])
    observed = registrations.source(row)
    kept = generator(*axes, "clouds").permutation(len(observed))[:points]
    return Pair(
        observed[kept],
        registrations.target(row)[:points].astype(np.float64),  # in random order
        registrations.T_target_source("init", row),
        seed=seed_of(*axes, "draws"),
    ).with_normals(neighbors)


def attempts(
    name: str, method: Method, pair: Pair, start: str, coarse_and_seconds: tuple[Outcome, float]
) -> Iterator[tuple[str, Outcome, float]]:
    """Yield start, outcome and seconds of each run of a method; those of the global method `start` are known."""
    coarse, coarse_seconds = coarse_and_seconds
    if name == start:
        yield NO_START, coarse, coarse_seconds
    elif method_entry(name).is_global:
        yield NO_START, *timed(method, pair)
    else:
        yield INITIAL, *timed(method, pair)
        if coarse.converged:
            outcome, seconds = timed(method, pair.started_at(coarse.T_target_source))
            yield start, outcome, coarse_seconds + seconds
        else:
            yield start, replace(coarse, failure=f"{start}: {coarse.failure}"), coarse_seconds


def timed(method: Method, pair: Pair) -> tuple[Outcome, float]:
    """Return what a method makes of a pair, and the seconds that it took."""
    started = perf_counter()
    outcome = method(pair)
    return outcome, perf_counter() - started
