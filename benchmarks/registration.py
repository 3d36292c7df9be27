"""Milliseconds of every registration method, and their ratio to Open3D's point-to-point ICP.

    python benchmarks/registration.py [--samples 12] [--points 512] [--repeats 3] [--methods gicp teaser]

Everything runs in one process on one thread, on registrations of the procedural coffee cups, a third of them under each
concept, with at most `points` points in each cloud. For each pair the reference and the method run in turn (A B A B …);
`ratio` is the median over pairs and repeats, `ms` the median of the method. The reference is Open3D's function alone,
the method all that it needs of a pair: trees, features, and the one step that tells whether it came to rest. Normals
are estimated beforehand and have a row of their own. A method whose package is missing is left out and named. The last
line is a JSON object: reference_ms, normals_ms, and ms_<method>, ratio_<method>.
"""

import argparse
import json
import sys
from pathlib import Path
from statistics import median
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare()
    from gpca.alignment.icp import ICP, ICPSettings
    from gpca.alignment.methods.registry import left_out, make_method, methods

    names = options.methods or list(methods())
    missing = left_out(names)
    bare = make_pairs(options.samples, options.points)
    pairs = [pair.with_normals() for pair in bare]

    def reference(pair):
        return ICP(pair.target, None, ICPSettings()).register(pair.source, pair.T_target_source_init)

    reference(pairs[0])
    result = {
        "reference_ms": 1e3 * median(seconds(reference, pair) for pair in pairs),
        "normals_ms": 1e3 * median(seconds(type(pair).with_normals, pair) for pair in bare),
    }
    print(f"{len(pairs)} pairs of up to {options.points} points, {options.repeats} repeats, 1 thread")
    print(f"Open3D's point-to-point {result['reference_ms']:.2f} ms; both clouds' normals {result['normals_ms']:.2f}\n")
    print(f"{'method':24}{'ms':>9}{'ratio':>9}{'failed':>8}")
    for name in (name for name in names if name not in missing):
        method = make_method(name)
        failed = sum(not method(pair).converged for pair in pairs)  # and what is compiled or loaded at the first call
        turns = [(seconds(reference, pair), seconds(method, pair)) for _ in range(options.repeats) for pair in pairs]
        result[f"ms_{name}"] = 1e3 * median(own for _, own in turns)
        result[f"ratio_{name}"] = median(own / open3d for open3d, own in turns)
        print(f"{name:24}{result[f'ms_{name}']:9.2f}{result[f'ratio_{name}']:9.2f}{failed:8d}", flush=True)
    for name, package in missing.items():
        print(f"{name:24}skipped: the package {package} is not installed")
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"samples": 12, "points": 512, "repeats": 3}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    parser.add_argument("--methods", nargs="+", help="names of registration methods; default: all")
    options = parser.parse_args(arguments)
    if options.samples < 6 or options.samples % 3 or options.points < 64 or options.repeats < 1:
        parser.error("samples must be a multiple of 3 and at least 6, points at least 64, repeats 1")
    return options


def make_pairs(samples: int, points: int) -> list:
    """Return the observed pairs of so many test registrations, in diameters."""
    import numpy as np

    from benchmarks.explainers import make_registrations
    from gpca.alignment.methods.interface import Pair
    from gpca.uncertainty.designs import RegisteredRow

    registrations, _ = make_registrations(samples)
    observed = [
        RegisteredRow(registrations, row).observed(points, np.random.default_rng(row))
        for row in registrations.rows("test")
    ]
    return [Pair(source, target, T_init, seed=n) for n, (source, target, T_init, _) in enumerate(observed)]


def seconds(function, *arguments) -> float:
    """Return the wall time of one call."""
    started = perf_counter()
    function(*arguments)
    return perf_counter() - started


if __name__ == "__main__":
    main()
