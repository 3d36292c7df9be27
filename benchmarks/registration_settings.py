"""Registrations that succeed with other settings and numbers of points, on development objects (docs/registration.md).

    snakemake -j2 registrations --configfile config/development.yaml
    python benchmarks/registration_settings.py results/development [--pairs 21] [--methods fgr teaser]

The pairs are those of Table XI, of objects that no table shows, so many of each seed, spread over the objects; with
`--failed 60`, pairs that point-to-point ICP does not register, where the columns of causes overlap. With `--refined`,
that ICP starts from what each candidate found, as in Table XX. Each candidate is compared with `posterior` pair by
pair; intervals are over families of objects and seeds. The last line is a JSON object: success_<candidate>, in %.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from statistics import median
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from gpca.process.processor import prepare

Given = tuple[
    int, str, np.ndarray, Callable, Callable
]  # seed, family, causes (3,), points and neighbors -> pair, error
DRAWN_SEED = 100
POSE = 1  # among noise, pose, overlap
SUCCESS = 0.03  # diameters, as in the config
REFERENCE = "posterior"
MANY = {"points": 2048, "neighbors": 80}
WIDE = {"feature_neighbors": 400}
CANDIDATES: dict[str, list[tuple[dict, dict]]] = {  # method -> (its settings, what the pair has)
    REFERENCE: [({}, {})],
    "posterior_global": [({}, {}), ({}, {"points": 2048})],
    "point_to_point": [({}, {}), ({"correspondence_distance": 0.25}, {})],
    "point_to_plane": [({}, {})],
    "trimmed": [({}, {})],
    "multistart": [*(({"overlap": share}, {}) for share in (0.5, 0.7, 0.9)), ({"wide_distance": 0.1}, {})],
    "multistart_likelihood": [({}, {}), ({"wide_distance": 0.1}, {})],
    "cpd": [({"outliers": share}, {}) for share in (0.01, 0.1, 0.3)],
    "fgr": [
        ({}, {}),
        ({}, {"points": 2048}),
        *(({"inlier_distance": limit}, {"points": 2048}) for limit in (0.025, 0.1)),
        (WIDE, MANY),
        (WIDE | {"inlier_distance": 0.025}, MANY),
    ],
    "fpfh_ransac": [
        ({}, {}),
        ({"feature_radius": 0.35}, {}),
        ({"iterations": 100_000}, {}),
        (WIDE, {}),
        (WIDE, MANY),
        *((WIDE | {"inlier_distance": limit}, MANY) for limit in (0.03, 0.075)),
        (WIDE | {"feature_radius": 0.35}, MANY),
    ],
    "teaser": [
        ({}, {}),
        *(({"noise": limit}, {}) for limit in (0.03, 0.075)),
        (WIDE, {}),
        (WIDE, MANY),
        *((WIDE | {"noise": limit}, MANY) for limit in (0.03, 0.075)),
        (WIDE | {"most_matches": 600}, MANY),
    ],
    "kiss_matcher": [({"voxel": edge}, {"points": 2048}) for edge in (0.03, 0.04, 0.05, 0.06, 0.08, 0.1, 0.12)],
}


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="folder of a run on development objects")
    parser.add_argument("--pairs", type=int, default=21, help="of each seed")
    parser.add_argument("--failed", type=int, help="so many pairs that ICP does not register instead")
    parser.add_argument("--refined", action="store_true", help="by ICP")
    parser.add_argument("--methods", nargs="+", choices=list(CANDIDATES), default=list(CANDIDATES))
    options = parser.parse_args(arguments)
    prepare()
    from gpca.alignment.methods.registry import left_out
    from gpca.evaluation.intervals import Clustered

    missing = left_out(options.methods)
    names = [name for name in dict.fromkeys([REFERENCE, *options.methods]) if name not in missing]
    candidates = {label(name, *candidate): (name, *candidate) for name in names for candidate in CANDIDATES[name]}
    given = (
        failed_pairs(options.results, options.failed)
        if options.failed
        else pairs_of_table(options.results, options.pairs)
    )
    seeds, families, causes, errors, seconds = registered(given, candidates, options.refined)
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
        by_cause = " | ".join(f"{100 * right[with_cause_N].mean():.0f}" for with_cause_N in causes.T)
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


def registered(given: Iterator[Given], candidates: dict[str, tuple[str, dict, dict]], refined: bool) -> tuple:
    """Return seeds and families (N,) and causes (N, 3) of the pairs, and errors (N,) and seconds of each candidate.

    The error of a registration that failed is infinite.
    """
    from gpca.alignment.methods.registry import make_method

    methods = {name: make_method(method, settings) for name, (method, settings, _) in candidates.items()}
    refine = make_method("point_to_point")
    errors: dict[str, list[float]] = {name: [] for name in candidates}
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    known = []
    for *about, pair_of, error_of in given:
        for name, (_, _, of) in candidates.items():
            pair = pair_of(of.get("points", 512), of.get("neighbors", 20))
            if not known:
                methods[name](pair)  # compiles
            started = process_time()  # other processes do not count
            outcome = methods[name](pair)
            seconds[name].append(process_time() - started)
            T = outcome.T_target_source
            if refined and outcome.converged:
                T = refine(pair.started_at(T)).T_target_source
            errors[name].append(error_of(T) if outcome.converged else np.inf)
        known.append(about)
    seeds, families, causes = (np.array(each) for each in zip(*known, strict=True))
    return seeds, families, causes, {name: np.array(each) for name, each in errors.items()}, seconds


def pairs_of_table(results: Path, pairs: int) -> Iterator[Given]:
    """Yield the pairs of Table XI, so many of each seed."""
    from gpca.objects.canonical import ObjectClouds
    from gpca.pairs.dataset import Registrations
    from gpca.pairs.judge import Judges
    from gpca.pairs.perturbation import CONCEPTS
    from gpca.seeds import seed_of_file
    from gpca.steps.registration_trials import pair_to_register

    for path in sorted(results.glob("registrations/*/seed*.npz")):
        source, seed = path.parent.name, seed_of_file(path)
        objects = ObjectClouds.load(results / f"objects/{source}.npz", source)
        registrations, judges = Registrations.load(path, (source, seed)), Judges(objects, source)
        for row in spread(registrations, pairs, seed):
            family = str(objects.families[registrations.object_index[row]])
            judge, T_true = judges.of(registrations, row), registrations.T_target_source("true", row)
            yield (
                *(seed, family, np.array(CONCEPTS) == registrations.concept[row]),
                cache(partial(pair_to_register, registrations, row, source, seed)),
                lambda T, judge=judge, T_true=T_true: judge(T, T_true)["add_relative"],
            )


def failed_pairs(results: Path, count: int) -> Iterator[Given]:
    """Yield so many pairs with any of the causes of docs/causes.md that point-to-point ICP does not register."""
    from gpca.alignment.methods.interface import Pair
    from gpca.alignment.methods.registry import make_method
    from gpca.causes.candidate import draw_candidate
    from gpca.causes.measuring import read_subjects
    from gpca.causes.settings import CauseSettings
    from gpca.objects.canonical import ObjectClouds
    from gpca.rigid import transform
    from gpca.seeds import generator

    settings, icp = CauseSettings(), make_method("point_to_point")
    [path] = results.glob("objects/*.npz")
    subjects, drawn = read_subjects(ObjectClouds.load(path, path.stem)), 0
    while count:
        drawn += 1
        random = generator("registration settings", drawn)
        subject, applied = subjects[random.integers(len(subjects))], random.random(3) < settings.present
        candidate = draw_candidate(subject.surface, applied, settings, random)
        T_init = candidate.T_init if applied[POSE] else candidate.T_near
        source = transform(T_init, candidate.observed(tuple(np.flatnonzero(applied))))
        pair = Pair(source, candidate.model.astype(np.float64), seed=drawn)

        def error_of(T: np.ndarray, subject=subject, T_init=T_init) -> float:
            return float(subject.errors((T @ T_init)[None])[0])

        if error_of(icp(pair).T_target_source) >= SUCCESS:
            count -= 1
            normals = cache(lambda neighbors, pair=pair: pair.with_normals(neighbors))
            yield DRAWN_SEED, subject.family, applied, lambda _, neighbors, of=normals: of(neighbors), error_of


def spread(registrations, pairs: int, seed: int) -> np.ndarray:
    """Return the rows of so many test samples, in threes of one object, from other threes in each seed."""
    samples = np.sort(registrations.sample[registrations.rows("test")])
    threes = len(samples) // 3
    chosen = (np.arange(pairs // 3) * threes // (pairs // 3) + seed) % threes
    return np.flatnonzero((registrations.split == "test") & np.isin(registrations.sample // 3, chosen))


if __name__ == "__main__":
    main()
