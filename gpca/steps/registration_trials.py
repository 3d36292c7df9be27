"""Step ``register_methods``: the test pairs of registrations, registered by every method."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import Annotated, TypeVar

import numpy as np

from gpca.alignment.features import NEIGHBORS
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method, method_entry, require_global
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.judge import Judges
from gpca.pairs.perturbation import SEVERITIES
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds

Result = TypeVar("Result")
INITIAL, NO_START = "initial", "none"  # where a registration starts; else, the name of a global method
SEVERITY_COLUMNS = tuple(f"severity_{name}" for name in SEVERITIES)
Points = Annotated[int, Bounds(minimum=64, maximum=65536)]


@dataclass(frozen=True)
class PairSettings:
    """The pairs that every method registers."""

    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]  # test samples of each source and seed, balanced, at most
    points: Points  # of source and of target, at most
    global_start: str  # the global method at whose pose local methods start a second time
    points_of: dict[str, Points] = field(default_factory=dict)  # of methods whose authors use more than others do
    # Of methods: neighbors for normals, where not the usual number
    neighbors_of: dict[str, Annotated[int, Bounds(minimum=3, maximum=1000)]] = field(default_factory=dict)


def run(job: Job) -> None:
    """Register by every method, seed by seed; the one that gives the others a start runs in any case."""
    settings = PairSettings(**job.section("method_pairs"))
    start = [settings.global_start] if settings.global_start in job.section("methods") else []
    methods = job.by_name("methods", dict.fromkeys([*job.methods, *start]))
    objects = ObjectClouds.load(job.objects, job.source)
    for i, (seed, path) in enumerate(job.per_seed("registrations")):
        outputs = [files[i :: len(job.seeds)] for files in (job.rows, job.timings)]
        with record_provenance([*outputs[0], *outputs[1]], [job.objects, path], job.settings, seed=seed):
            registrations = Registrations.load(path, (job.source, seed))
            trials = try_methods(registrations, objects, job.source, seed, methods, settings)
            write_trials([trials[name] for name in job.methods], *outputs)


def try_methods(
    registrations: Registrations,
    objects: ObjectClouds,
    source: str,
    seed: int,
    methods: Mapping[str, Mapping],
    settings: PairSettings,
) -> dict[str, Frame]:
    """Return for each method a row per pair and start, with the points that it had; see :func:`try_each`."""
    rows = np.flatnonzero((registrations.split == "test") & (registrations.sample < settings.samples)).tolist()
    of_objects = Judges(objects, f"objects of {source}")
    judges = {row: of_objects.of(registrations, row) for row in rows}
    given = lru_cache(maxsize=4)(lambda *of: pair_to_register(registrations, of[0], source, seed, *of[1:]))

    def asked(row: int, name: str) -> tuple[Pair, dict]:
        points, neighbors = settings.points_of.get(name, settings.points), settings.neighbors_of.get(name, NEIGHBORS)
        pair = given(row, points, neighbors)
        return pair, {
            "sample": registrations.sample[row],
            "object": registrations.object_name[row],
            "concept": registrations.concept[row],
            **{column: getattr(registrations, column)[row] for column in SEVERITY_COLUMNS},
            "symmetric": judges[row].symmetric,
            "points": (len(pair.source) + len(pair.target)) / 2,
        }

    def errors(row: int, T_target_source: np.ndarray) -> dict:
        return judges[row](T_target_source, registrations.T_target_source("true", row))

    title = f"registration methods on {source}, seed {seed}"
    return try_each(methods, settings.global_start, "method_pairs", progress(rows, title), asked, errors)


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


def outcomes_by(
    methods: Mapping[str, Mapping], registrations: Registrations, source: str, seed: int, points: int
) -> dict[str, list[Outcome]]:
    """Return the outcome of each method for each registration."""
    made = {name: make_method(name, entry) for name, entry in methods.items()}
    outcomes: dict[str, list[Outcome]] = {name: [] for name in made}
    for row in progress(range(len(registrations)), f"registrations by other methods of {source}, seed {seed}"):
        pair = pair_to_register(registrations, row, source, seed, points)
        for name, method in made.items():
            outcomes[name].append(method(pair))
    return outcomes


def try_each(
    methods: Mapping[str, Mapping],
    start: str,
    section: str,
    samples: Iterable[int],
    asked: Callable[[int, str], tuple[Pair, dict]],
    errors: Callable[[int, np.ndarray], dict],
) -> dict[str, Frame]:
    """Return rows of every sample by method: local methods run again from the pose of the global one named `start`.

    Each method is called once before the first sample, so that no time includes what it loads or compiles. `asked`
    gives what a method gets for a sample, and the first columns of its rows; `errors` those of a pose (4×4).
    """
    import pandas as pd

    made = {name: make_method(name, entry) for name, entry in methods.items()}
    require_global(start)
    if start not in made:
        raise InputError(f"{section}.global_start", f"'{start}' is not among the methods", "add it or name another")
    records: dict[str, list[dict]] = {name: [] for name in made}
    for i, sample in enumerate(samples):
        for name, method in made.items() if i == 0 else ():
            method(asked(sample, name)[0])
        coarse, coarse_seconds = timed(made[start], asked(sample, start)[0])
        for name, method in made.items():
            pair, known = asked(sample, name)
            if name == start:
                attempts = [(NO_START, coarse, coarse_seconds)]
            elif method_entry(name).is_global:
                attempts = [(NO_START, *timed(method, pair))]
            else:
                second, seconds = replace(coarse, failure=f"{start}: {coarse.failure}"), 0.0
                attempts = [(INITIAL, *timed(method, pair))]
                if coarse.converged:
                    second, seconds = timed(method, pair.started_at(coarse.T_target_source))
                attempts.append((start, second, coarse_seconds + seconds))
            for started_at, outcome, seconds in attempts:
                of_outcome = {key: getattr(outcome, key) for key in ("fitness", "inlier_rmse", "failure")}
                row = known | {"start": started_at} | errors(sample, outcome.T_target_source) | of_outcome
                records[name].append(row | {"seconds": seconds})
    return {name: pd.DataFrame(of_method) for name, of_method in records.items()}


def timed(function: Callable[..., Result], *arguments: object) -> tuple[Result, float]:
    started = perf_counter()
    result = function(*arguments)
    return result, perf_counter() - started


def write_trials(trials: Iterable[Frame], outputs: list[Path], timings: list[Path]) -> None:
    for rows, out, seconds in zip(trials, outputs, timings, strict=True):
        write_csv(out, rows.drop(columns="seconds"))
        write_csv(seconds, rows[["sample", "start", "seconds"]])
