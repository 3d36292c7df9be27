"""One fit of the GPC and the explanation of one sample: how long each takes on one thread.

    python benchmarks/gpc.py [--samples 800] [--width 512] [--inducing 64] [--iterations 100] [--draws 1000]
                             [--kernel rbf] [--repeats 3]

The embeddings are drawn: three overlapping blobs. Fit and explanation are compared with those in gpytorch's own classes
(gpca/classifier/gpytorch_classes.py), in turn (A B A B …), from the same inducing inputs, kernels and random numbers; a
ratio is the median over the pairs. Both count standardisation, k-means and the median distance. An explanation is
everything from the embedding on: kernel, posterior, draws, scores, variances, BALD. The last line is a JSON object:
fit_s, gpytorch_fit_s, fit_speedup, one_sample_ms, ms_200_samples, gpytorch_ms_200_samples, and the largest differences:
max_abs_error (of a latent's mean) and max_score_difference.
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

LEARNING_RATE = 0.01  # the paper's


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare()
    import numpy as np
    import torch

    from gpca.classifier.gpc import GPC
    from gpca.classifier.gpytorch_classes import GpytorchGPC
    from gpca.classifier.settings import GPCSettings
    from gpca.pairs.perturbation import CONCEPTS

    torch.set_num_threads(1)
    h_N_d, labels_N = blobs(options.samples, options.width)
    h_test_d, _ = blobs(200, options.width)
    settings = GPCSettings(options.kernel, LEARNING_RATE, options.iterations, options.inducing, options.draws)
    ours_s, plain_s = [], []
    for _ in range(options.repeats):
        gpc = GPC(CONCEPTS, settings, "benchmark", 0)
        ours_s.append(seconds(lambda gpc=gpc: gpc.fit(h_N_d, labels_N)))
        plain = GpytorchGPC(CONCEPTS, settings, "benchmark", 0)
        plain_s.append(seconds(lambda plain=plain: plain.fit(h_N_d, labels_N)))
    error = float(np.abs(gpc.posterior(h_test_d)[0] - plain.posterior(h_test_d)[0]).max())
    score_difference = float(np.abs(gpc.attribute(h_test_d)[0] - plain.attribute(h_test_d)[0]).max())
    one_s = [seconds(lambda row=row: gpc.attribute(h_test_d[row : row + 1])) for row in range(20 * options.repeats)]
    all_s = [seconds(lambda: gpc.attribute(h_test_d)) for _ in range(5 * options.repeats)]
    plain_all_s = [seconds(lambda: plain.attribute(h_test_d)) for _ in range(5 * options.repeats)]
    speedup = median(plain / ours for plain, ours in zip(plain_s, ours_s, strict=True))
    print(f"fit of {options.samples} embeddings of width {options.width}, {options.kernel} kernel, {options.inducing}")
    print(f"inducing inputs, {options.iterations} iterations: {median(ours_s):.2f} s;")
    print(f"in gpytorch's own classes {median(plain_s):.2f} s;")
    print(f"largest difference of a latent's mean {error:.1e}, of a score {score_difference:.1e}")
    print(f"{options.draws} draws and scores: {1e3 * median(one_s):.2f} ms for one sample,")
    print(f"{1e3 * median(all_s):.1f} ms for 200, by gpytorch's posterior {1e3 * median(plain_all_s):.1f} ms")
    result = {
        "fit_s": median(ours_s), "gpytorch_fit_s": median(plain_s), "fit_speedup": speedup,
        "one_sample_ms": 1e3 * median(one_s), "ms_200_samples": 1e3 * median(all_s),
        "gpytorch_ms_200_samples": 1e3 * median(plain_all_s), "max_abs_error": error,
        "max_score_difference": score_difference,
    }  # fmt: skip
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    defaults = {"samples": 800, "width": 512, "inducing": 64, "iterations": 100, "draws": 1000, "repeats": 3}
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    parser.add_argument("--kernel", choices=("rbf", "matern32", "polynomial"), default="rbf", help="default rbf")
    options = parser.parse_args(arguments)
    if options.samples < 6 or options.draws < 2 or min(getattr(options, name) for name in defaults) < 1:
        parser.error("samples must be at least 6, draws 2 and the others 1")
    return options


def blobs(n: int, width: int):
    """Return n points of three overlapping blobs, the same blobs at every call, and their labels."""
    import numpy as np

    from gpca.pairs.perturbation import CONCEPTS

    blob = np.arange(n) % 3
    centres = 0.15 * np.random.default_rng(0).normal(size=(3, width))
    return centres[blob] + np.random.default_rng(n).normal(size=(n, width)), np.array(CONCEPTS)[blob]


def seconds(function) -> float:
    """Return the wall time of one call."""
    started = perf_counter()
    function()
    return perf_counter() - started


if __name__ == "__main__":
    main()
