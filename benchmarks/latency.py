"""How long one explanation takes, with the diagnosis and with the fast one, on perturbed ellipsoids.

    python benchmarks/latency.py [--model results/full/model.pt] [--threads 1] [--points 512] [--pairs 12] [--repeats 9]

Both are timed in turn, by the model that is named or found. The last line is a JSON object of their medians: median_ms,
median_ms_fast.

    python benchmarks/latency.py --installed env/bin/python [other/bin/python ...] [--repeats 5]

Whole commands `gpca explain` are timed in turn, by Pythons in whose environments the package is installed: the first
call in a fresh home, and later ones. Of each environment, the last lines are JSON objects: CPU seconds and peak memory
of both (medians), size and number of its packages.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

WARM_UP = 3
SIZE = """
from importlib.metadata import distributions
from pathlib import Path
from sysconfig import get_paths
files = [path.stat().st_size for path in Path(get_paths()["purelib"]).rglob("*") if path.is_file()]
print(sum(files), len([*distributions()]))
"""


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare(options.threads)
    if options.installed:
        time_processes(options)
        return
    time_model(options)


def time_model(options: argparse.Namespace) -> None:
    """Print the times of explanations by the model file that is named."""
    from gpca.model.explainer import Explainer

    explainer = Explainer.load(options.model)
    pairs = [make_pair(options.points, "latency", n) for n in range(options.pairs)]
    kinds = {"with diagnosis": {}, "fast": {"fast": True}}
    seconds: dict[str, list[float]] = {kind: [] for kind in kinds}
    stages_s = []
    for repeat in range(WARM_UP + options.repeats):
        for kind, how in kinds.items():
            elapsed, said = timed(lambda pair, how=how: explainer.explain(*pair, **how), pairs[repeat % len(pairs)])
            if repeat >= WARM_UP:
                seconds[kind].append(elapsed)
                stages_s += [] if how else [said.seconds]
    print(f"one explanation, {options.points} points, {options.threads} thread(s), {options.repeats} repeats in turn;")
    print("ms: median (least, largest)\n")
    for kind, of_kind in seconds.items():
        print(f"{kind:20}{1e3 * median(of_kind):8.1f} ({1e3 * min(of_kind):.1f}, {1e3 * max(of_kind):.1f})")
    for stage in stages_s[0]:
        print(f"{stage:20}{1e3 * median(of_stage[stage] for of_stage in stages_s):8.2f}")
    names = dict(zip(kinds, ("median_ms", "median_ms_fast"), strict=True))
    print(json.dumps({names[kind]: float(f"{1e3 * median(of_kind):.4g}") for kind, of_kind in seconds.items()}))


def time_processes(options: argparse.Namespace) -> None:
    """Print what whole commands take by each of the given Pythons."""
    import numpy as np

    taken: dict[Path, dict[str, list[tuple[float, float]]]] = {}
    with TemporaryDirectory() as folder:
        for role, cloud in zip(("source", "target"), make_pair(2000, "latency", 0), strict=True):
            np.save(Path(folder, f"{role}.npy"), 100 * cloud)
        for repeat in range(options.repeats):
            for python in options.installed:
                home = Path(folder, f"{python.absolute().as_posix().replace('/', '_')}-{repeat}")
                home.mkdir()
                for call in ("first", "later"):
                    taken.setdefault(python, {}).setdefault(call, []).append(run_command(python, home))
    for python, calls in taken.items():
        result = {
            f"{call}_{unit}": median(values)
            for call, pairs in calls.items()
            for unit, values in zip(("cpu_s", "peak_mb"), zip(*pairs, strict=True), strict=True)
        }
        asked = subprocess.run([python, "-c", SIZE], capture_output=True, text=True, check=True).stdout.split()
        result |= {"packages_mb": int(asked[0]) / 1e6, "packages": int(asked[1])}
        print(json.dumps({"python": str(python)} | {name: float(f"{value:.3g}") for name, value in result.items()}))


def run_command(python: Path, home: Path) -> tuple[float, float]:
    """Return CPU seconds and peak memory (MB) of an explanation of the pair in the folder of a user's home."""
    command = [python.absolute(), "-m", "gpca", "explain", "../source.npy", "../target.npy", "--unit", "mm", "--json"]
    folders = {name: str(home) for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "GPCA_MODEL")}
    process = subprocess.Popen(command, cwd=home, env=environment | folders, stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{python}: the command failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"threads": 1, "points": 512, "pairs": 12, "repeats": 50}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    parser.add_argument("--model", type=Path, help="model file whose explanations are timed")
    parser.add_argument("--installed", type=Path, nargs="+", help="Pythons whose whole commands are timed")
    options = parser.parse_args(arguments)
    if options.points < 64 or min(options.threads, options.pairs, options.repeats) < 1:
        parser.error("points must be at least 64 and the others 1")
    return options


def make_pair(n_points: int, *axes: object):
    """Return source and target (N, 3) on an ellipsoid of diameter one; the source noisy, moved or cropped."""
    import numpy as np

    from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, Severities
    from gpca.seeds import generator

    random = generator("benchmark", *axes)
    clouds = random.normal(size=(2, 2 * n_points, 3))
    clouds *= np.array([0.5, 0.3, 0.2]) / np.linalg.norm(clouds, axis=-1, keepdims=True)
    perturbed = PERTURBATIONS[CONCEPTS[axes[-1] % 3]](clouds[0], Severities(crop=(0.2, 0.5)), random)
    return perturbed.points[:n_points], clouds[1, :n_points]


def timed(function, *arguments):
    """Return the wall time of one call, and its result."""
    started = perf_counter()
    result = function(*arguments)
    return perf_counter() - started, result


if __name__ == "__main__":
    main()
