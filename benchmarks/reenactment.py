"""Milliseconds that the search for the true pose takes, and the enactment of the hypotheses.

    python benchmarks/reenactment.py [--pairs 12] [--points 512]

On one thread, on pairs of a procedural object with a pose error, every second one noisy, every third cropped. The plain
reference is expectation maximization of the same mixture in NumPy, over all points of the model, on the first pair. The
last line is a JSON object: search_ms, enact_ms (medians of a pair, with all its hypotheses), speedup of the mixture,
max_abs_error (of its mean log-likelihood at the same pose, nats).
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

ITERATIONS = 10


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=12)
    parser.add_argument("--points", type=int, default=512, help="of either cloud")
    options = parser.parse_args(arguments)
    prepare()
    import numpy as np

    from benchmarks.causes import procedural
    from gpca.causes.candidate import draw_candidate
    from gpca.causes.measuring import read_subjects
    from gpca.causes.settings import CauseSettings
    from gpca.reenactment.enactment import NoiseScale, enact, observe, rebuild
    from gpca.reenactment.hypotheses import find_hypotheses
    from gpca.reenactment.mixture import Mixture
    from gpca.reenactment.settings import ReenactmentSettings
    from gpca.reenactment.surface import ModelSurface

    truth = CauseSettings(points=(options.points, options.points))
    subjects = read_subjects(procedural("ycb"))
    search_s, enact_s, compared = [], [], ()
    for number in range(-1, options.pairs):  # the first compiles
        random = np.random.default_rng(100 + number)
        applied = np.array([number % 2 == 0, True, number % 3 == 0])
        candidate = draw_candidate(subjects[number % len(subjects)].surface, applied, truth, random)
        causes = tuple(np.flatnonzero(applied).tolist())
        before = candidate.observed(causes) @ candidate.T_init[:3, :3].T + candidate.T_init[:3, 3]
        started = perf_counter()
        surface = ModelSurface(candidate.model)
        hypotheses = find_hypotheses(before, surface, np.eye(4)[None], ReenactmentSettings(), random)
        found = perf_counter()
        scale = NoiseScale(surface, random)
        for hypothesis in hypotheses:
            observation = observe(before, hypothesis, surface, scale, random)
            rebuilt = rebuild(hypothesis.T, observation, surface, random)
            enact(hypothesis, rebuilt, surface.errors, ("benchmark", number), truth)
        if number >= 0:
            search_s.append(found - started)
            enact_s.append(perf_counter() - found)
            compared = compared or (surface.points, before, hypotheses[0].T)
    model, before, T = compared
    started = perf_counter()
    fits = Mixture(model, 0.01).fit(before, T[None], ITERATIONS, moving=False)
    ours_s = perf_counter() - started
    started = perf_counter()
    plain = plain_log_likelihood(model, before @ T[:3, :3].T + T[:3, 3], 0.01)
    plain_s = perf_counter() - started
    result = {
        "search_ms": 1e3 * median(search_s),
        "enact_ms": 1e3 * median(enact_s),
        "speedup": plain_s / ours_s,
        "max_abs_error": abs(plain - float(fits.log_likelihood_n[0])),
    }
    for name, value in result.items():
        print(f"{name:16s}{value:10.3g}")
    print(json.dumps({name: float(f"{value:.4g}") for name, value in result.items()}))


def plain_log_likelihood(model, observed, least_width: float) -> float:
    """Return the mean log-likelihood of the mixture after as many iterations, of every partner of every point."""
    import numpy as np

    from gpca.reenactment.mixture_kernels import (
        FEWEST_OUTLIERS,
        FIRST_OUTLIERS,
        FIRST_WIDTH,
        LARGEST_WIDTH,
        MOST_OUTLIERS,
    )

    square_N_M = np.square(observed[:, None] - model).sum(axis=2)
    variance, outliers = max(least_width, FIRST_WIDTH) ** 2, FIRST_OUTLIERS
    for iteration in range(ITERATIONS + 1):
        weight_N_M = np.exp(-0.5 * square_N_M / variance)
        normal_N = (1 - outliers) * weight_N_M.mean(axis=1) * (2 * np.pi * variance) ** -1.5
        if iteration == ITERATIONS:
            break
        inlier_N = normal_N / (normal_N + outliers)
        spread_N = (weight_N_M * square_N_M).sum(axis=1) / np.maximum(weight_N_M.sum(axis=1), 1e-300)
        variance = float(np.clip((inlier_N * spread_N).sum() / (3 * inlier_N.sum()), least_width**2, LARGEST_WIDTH**2))
        outliers = float(np.clip(1 - inlier_N.mean(), FEWEST_OUTLIERS, MOST_OUTLIERS))
    return float(np.log(normal_N + outliers).mean())


if __name__ == "__main__":
    main()
