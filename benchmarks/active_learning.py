"""BALD over a pool, the selection of a batch and one retraining of the GPC: how long each takes on one thread.

    python benchmarks/active_learning.py [--pool 800] [--labels 100] [--draws 1000] [--repeats 15]

The pool's embeddings are drawn: three overlapping blobs in 512 dimensions; a GPC of 64 inducing inputs knows two of
them. BALD by the suite is compared with a plain loop over the draws, in turn (A B A B …), from the same posterior
marginals and the same random numbers; the ratio is the median over the pairs. Selection is all of a round before the
label: posterior, BALD, k-means. Retraining is the warm start that the rounds use, at `labels` labels, for 4 more. The
last line is a JSON object: bald_speedup, select_ms, retrain_s, and max_abs_error of BALD in nats.
"""

import argparse
import json
import sys
from copy import copy
from pathlib import Path
from statistics import median
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

BATCH = 4


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare()
    import torch

    torch.set_num_threads(1)
    gpc, pool, h_more, more = make_pool(options)
    plain_s, ours_s, error = compare_bald(gpc, pool, options)
    speedup = median(plain / ours for plain, ours in zip(plain_s, ours_s, strict=True))
    select_s = [seconds(lambda: choose(gpc, pool)) for _ in range(options.repeats)]
    retrain_s = [seconds(lambda known: known.update(h_more, more), copy(gpc)) for _ in range(options.repeats)]
    print(f"BALD of {options.pool} embeddings, {options.draws} draws: {1e3 * median(ours_s):.1f} ms,")
    print(f"a plain loop over the draws {1e3 * median(plain_s):.1f} ms; largest difference {error:.1e} nats")
    print(f"selecting {BATCH} of them: {1e3 * median(select_s):.1f} ms")
    print(f"retraining at {options.labels} labels for {BATCH} more: {1e3 * median(retrain_s):.1f} ms")
    result = {
        "bald_speedup": speedup, "select_ms": 1e3 * median(select_s), "retrain_s": median(retrain_s),
        "max_abs_error": error,
    }  # fmt: skip
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"pool": 800, "labels": 100, "draws": 1000, "repeats": 15}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    options = parser.parse_args(arguments)
    if options.pool < BATCH or options.labels < BATCH or options.draws < 2 or options.repeats < 1:
        parser.error(f"pool and labels must be at least {BATCH}, draws 2 and repeats 1")
    return options


def make_pool(options: argparse.Namespace):
    """Return a GPC that knows two of three blobs, and as projections the pool and a few more labelled samples."""
    import numpy as np

    from gpca.classifier.gpc import GPC
    from gpca.classifier.settings import GPCSettings
    from gpca.pairs.perturbation import CONCEPTS

    random = np.random.default_rng(0)
    centres = 0.25 * random.normal(size=(3, 512))

    def draw(n: int, blobs: int):
        blob = np.arange(n) % blobs
        return centres[blob] + random.normal(size=(n, 512)), np.array(CONCEPTS)[blob]

    (h_labelled, labels), (h_pool, _), (h_more, more) = draw(options.labels, 2), draw(options.pool, 3), draw(BATCH, 3)
    settings = GPCSettings(learning_rate=0.2, iterations=40, draws=options.draws)
    gpc = GPC(CONCEPTS, settings, "benchmark", 0).fit(h_labelled, labels, np.concatenate([h_labelled, h_pool]))
    gpc.level()
    return gpc, gpc.project(h_pool), gpc.project(h_more), more


def compare_bald(gpc, pool, options: argparse.Namespace) -> tuple[list[float], list[float], float]:
    """Return the seconds of the plain loop and of ours, in pairs, and the largest difference of their BALD."""
    import numpy as np

    from gpca.classifier.scores import summarize_marginals

    mean_N_C, deviation_N_C = gpc.posterior(pool)
    normal_M_C = np.random.default_rng(1).normal(size=(options.draws, mean_N_C.shape[1]))
    of_plain, of_ours = [], []
    for _ in range(options.repeats):
        of_plain.append(seconds(lambda: plain_bald(mean_N_C, deviation_N_C, normal_M_C)))
        of_ours.append(seconds(lambda: summarize_marginals(mean_N_C, deviation_N_C, normal_M_C)))
    difference_N = (
        plain_bald(mean_N_C, deviation_N_C, normal_M_C) - summarize_marginals(mean_N_C, deviation_N_C, normal_M_C)[2]
    )
    return of_plain, of_ours, float(np.abs(difference_N).max())


def plain_bald(mean_N_C, deviation_N_C, normal_M_C):
    """Return BALD (N,) as Eq. 7 reads: one draw after the other, each for the whole pool."""
    import numpy as np

    sum_N_C, sum_of_entropies_N = np.zeros_like(mean_N_C), np.zeros(len(mean_N_C))
    for normal_C in normal_M_C:
        logits_N_C = mean_N_C + deviation_N_C * normal_C
        p_N_C = np.exp(logits_N_C - logits_N_C.max(axis=1, keepdims=True))
        p_N_C /= p_N_C.sum(axis=1, keepdims=True)
        sum_N_C += p_N_C
        sum_of_entropies_N -= (p_N_C * np.log(np.maximum(p_N_C, 1e-300))).sum(axis=1)
    scores_N_C = sum_N_C / len(normal_M_C)
    entropy_N = -(scores_N_C * np.log(np.maximum(scores_N_C, 1e-300))).sum(axis=1)
    return entropy_N - sum_of_entropies_N / len(normal_M_C)


def choose(gpc, pool):
    """Return the rows that BALD with k-means picks: all that a round does before it has the labels."""
    import numpy as np

    from gpca.active_learning.acquisition import Pool, select

    scores_N_C, _, bald_N = gpc.attribute(pool)
    candidates = Pool(pool.inputs_N_d, scores_N_C, bald_N, pool.inputs_N_d[:0], np.full(len(pool), ""))
    return select("bald_kmeans", candidates, BATCH, np.random.default_rng(0))


def seconds(function, *arguments) -> float:
    """Return the wall time of one call."""
    started = perf_counter()
    function(*arguments)
    return perf_counter() - started


if __name__ == "__main__":
    main()
