"""Registrations that succeed with other settings and numbers of points, on development objects (docs/registration.md).

    snakemake -j2 registrations --configfile config/development.yaml
    python benchmarks/registration_settings.py results/development [--pairs 21] [--methods fgr teaser]

The pairs are those of Table XI, of objects that no table shows, so many of each seed, spread over the objects. Each
candidate is compared with `posterior` pair by pair; intervals are over families of objects and seeds. The last line is
a JSON object: success_<candidate>, in %.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import cache, partial
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from gpca.process.processor import prepare

SUCCESS = 0.03  # diameters, as in the config
REFERENCE = "posterior"
MANY = {"points": 2048, "neighbors": 80}
WIDE = {"feature_neighbors": 400}
CANDIDATES: dict[str, list[tuple[dict, dict]]] = {  # method -> (its settings, what the pair has)
    REFERENCE: [({}, {})],
    "posterior_global": [({}, {})],
    "point_to_point": [({}, {}), ({"correspondence_distance": 0.25}, {})],
    "point_to_plane": [({}, {})],
    "trimmed": [({}, {})],
    "multistart": [*(({"overlap": share}, {}) for share in (0.5, 0.7, 0.9)), ({"wide_distance": 0.1}, {})],
    "multistart_likelihood": [({}, {}), ({"wide_distance": 0.1}, {})],
    "cpd": [({"outliers": share}, {}) for share in (0.01, 0.1, 0.3)],
    "fgr": [
        ({}, {"points": 2048}),
        *(({"inlier_distance": limit}, {"points": 2048}) for limit in (0.025, 0.1)),
        (WIDE, MANY),
        (WIDE | {"inlier_distance": 0.025}, MANY),
    ],
    "fpfh_ransac": [
        (WIDE, MANY),
        *((WIDE | {"inlier_distance": limit}, MANY) for limit in (0.03, 0.075)),
        (WIDE | {"feature_radius": 0.35}, MANY),
    ],
    "teaser": [
        (WIDE, MANY),
        *((WIDE | {"noise": limit}, MANY) for limit in (0.03, 0.075)),
        (WIDE | {"most_matches": 600}, MANY),
    ],
    "kiss_matcher": [({"voxel": edge}, {"points": 2048}) for edge in (0.04, 0.05, 0.06, 0.08)],
}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="folder of a run on development objects")
    parser.add_argument("--pairs", type=int, default=21, help="of each seed")
    parser.add_argument("--methods", nargs="+", choices=list(CANDIDATES), default=list(CANDIDATES))
    options = parser.parse_args(arguments)
    prepare()
    from gpca.alignment.methods.registry import left_out
    from gpca.evaluation.intervals import Clustered

    missing = left_out(options.methods)
    names = [name for name in dict.fromkeys([REFERENCE, *options.methods]) if name not in missing]
    candidates = {label(name, *candidate): (name, *candidate) for name in names for candidate in CANDIDATES[name]}
    seeds, families, causes, errors, seconds = registered(options.results, options.pairs, candidates)
    draws = Clustered.drawn(seeds, families, "registration settings")
    print(
        f"{len(seeds)} pairs, {len(set(families))} families, success: error below {100 * SUCCESS:g} % of the diameter"
    )
    print("| method | succeeds | noise | pose | overlap | minus `posterior` | mean error (% d) | ms |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    result = {}
    for name in candidates:
        right = errors[name] < SUCCESS
        value, low, high = (100 * each for each in draws.share(right))
        apart = (100 * each for each in draws.difference(right, errors[REFERENCE] < SUCCESS))
        by_cause = " | ".join(f"{100 * right[causes == cause].mean():.0f}" for cause in ("noise", "pose", "overlap"))
        ahead = "" if name == REFERENCE else "{:+.0f} ({:+.0f} to {:+.0f})".format(*apart)
        error = 100 * np.minimum(errors[name], 1).mean()
        took = 1e3 * median(seconds[name])
        print(f"| {name} | {value:.0f} ({low:.0f} to {high:.0f}) | {by_cause} | {ahead} | {error:.1f} | {took:.0f} |")
        result[f"success_{name}"] = value
    for name, package in missing.items():
        print(f"{name}: skipped, the package {package} is not installed")
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def label(name: str, settings: dict, of_pair: dict) -> str:
    """E.g. ``fgr inlier_distance=0.1 points=2048``."""
    return " ".join([name, *(f"{key}={value}" for key, value in (settings | of_pair).items())])


def registered(results: Path, pairs: int, candidates: dict[str, tuple[str, dict, dict]]) -> tuple:
    """Return seeds, families and causes (N,) of the pairs, and the errors (N,) and seconds of each candidate.

    The error of a registration that failed is infinite.
    """
    from gpca.alignment.methods.registry import make_method
    from gpca.objects.canonical import ObjectClouds
    from gpca.pairs.dataset import Registrations
    from gpca.pairs.judge import Judges
    from gpca.seeds import seed_of_file
    from gpca.steps.registration_trials import pair_to_register

    methods = {name: make_method(method, settings) for name, (method, settings, _) in candidates.items()}
    errors: dict[str, list[float]] = {name: [] for name in candidates}
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    known = []
    for path in sorted(results.glob("registrations/*/seed*.npz")):
        source, seed = path.parent.name, seed_of_file(path)
        objects = ObjectClouds.load(results / f"objects/{source}.npz", source)
        registrations, judges = Registrations.load(path, (source, seed)), Judges(objects, source)
        for row in spread(registrations, pairs, seed):
            pair_of = cache(partial(pair_to_register, registrations, row, source, seed))
            known.append((seed, objects.family(int(registrations.object_index[row])), registrations.concept[row]))
            for name, (_, _, of) in candidates.items():
                pair = pair_of(of.get("points", 512), of.get("neighbors", 20))
                if len(known) == 1:
                    methods[name](pair)  # compiles
                started = process_time()  # other processes do not count
                outcome = methods[name](pair)
                seconds[name].append(process_time() - started)
                error = judges.of(registrations, row)(
                    outcome.T_target_source, registrations.T_target_source("true", row)
                )["add_relative"]
                errors[name].append(error if outcome.converged else np.inf)
    seeds, families, causes = (np.array(each) for each in zip(*known, strict=True))
    return seeds, families, causes, {name: np.array(each) for name, each in errors.items()}, seconds


def spread(registrations, pairs: int, seed: int) -> np.ndarray:
    """Return the rows of so many test samples, in threes of one object, from other threes in each seed."""
    samples = np.sort(registrations.sample[registrations.rows("test")])
    threes = len(samples) // 3
    chosen = (np.arange(pairs // 3) * threes // (pairs // 3) + seed) % threes
    return np.flatnonzero((registrations.split == "test") & np.isin(registrations.sample // 3, chosen))


if __name__ == "__main__":
    main()
