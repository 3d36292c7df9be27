"""How often intervals of a share contain the true one: the bootstrap over clusters and seeds, Wilson's, and the farther
bounds of both (docs/comparison.md).

Families of objects differ in their rate of success: a beta distribution whose intraclass correlation is given. Prints a
table, and as its last line one JSON object of numbers.
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from gpca.evaluation.intervals import interval, pigeonhole_weights, quantile_bounds, wilson_interval
from gpca.seeds import generator

REPEATS = 100
DESIGNS = ((6, 3, 10), (12, 3, 10), (25, 3, 8))  # families, seeds, samples of each in a seed
RATES, CORRELATIONS = (0.5, 0.9, 0.98), (0.0, 0.1, 0.3)
NAMES = ("bootstrap", "wilson", "farther")


def main() -> None:
    """Simulate every design, and count hits."""
    print("families seeds samples correlation  rate   " + "   ".join(f"{name:>9}" for name in NAMES))
    hits, widths = {name: [] for name in NAMES}, {name: [] for name in NAMES}
    for families, seeds, samples in DESIGNS:
        for correlation in CORRELATIONS:
            for rate in RATES:
                random = generator("intervals", families, seeds, samples, correlation, rate)
                results = np.array(
                    [simulate(random, families, seeds, samples, correlation, rate) for _ in range(REPEATS)]
                )
                hit_3 = ((results[..., 0] <= rate) & (rate <= results[..., 1])).mean(axis=0)
                for name, hit, width in zip(NAMES, hit_3, np.ptp(results, axis=-1).mean(axis=0), strict=True):
                    hits[name].append(hit)
                    widths[name].append(width)
                row = "   ".join(f"{100 * hit:8.1f}%" for hit in hit_3)
                print(f"{families:8} {seeds:5} {samples:7} {correlation:11} {rate:5}   {row}")
    numbers = {f"coverage_{name}": float(np.mean(hits[name])) for name in NAMES}
    numbers |= {f"least_coverage_{name}": float(np.min(hits[name])) for name in NAMES}
    ratios = np.array(widths["farther"]) / np.array(widths["bootstrap"])
    print(json.dumps(numbers | {"largest_widening": float(ratios.max())}))


def simulate(
    random: np.random.Generator, families: int, seeds: int, samples: int, correlation: float, rate: float
) -> list[tuple[float, float]]:
    """Return the bounds of one simulated share, in the order of `NAMES`."""
    rate_K = np.full(families, rate)
    if correlation:
        concentration = 1 / correlation - 1
        rate_K = random.beta(rate * concentration, (1 - rate) * concentration, families)
    seed_N = np.repeat(np.arange(seeds), families * samples)
    family_N = np.tile(np.repeat(np.arange(families), samples), seeds)
    right_N = (random.random(len(family_N)) < rate_K[family_N]).astype(float)
    drawn_B_N = pigeonhole_weights(random, seed_N, family_N)
    value_B = np.append(right_N.mean(), (drawn_B_N * right_N).sum(axis=1) / drawn_B_N.sum(axis=1))
    wilson = wilson_interval(right_N.sum(), len(right_N))
    return [quantile_bounds(value_B[1:]), wilson, interval(value_B, drawn_B_N)[1:]]


if __name__ == "__main__":
    main()
