"""How much faster the per-point DGCNN is than the same network with one linear layer per edge.

    python benchmarks/edge_conv.py [--threads 2] [--batch 16] [--points 512] [--k 20] [--repeats 5]

Both networks hold the same weights and see the same clouds, in one process and in turn (A B A B …), so that whatever
else the machine does meets both. A training step is forward and backward, without an optimiser. The speed-ups are
medians over the pairs. The last line is a JSON object: train_speedup, infer_speedup, max_abs_error (of the
embeddings in eval mode).
"""

import argparse
import json
import sys
from pathlib import Path
from statistics import median
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from gpca.process.processor import prepare

PASSES = ("train", "infer")
NETWORKS = ("per edge", "per point")


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    # Before torch and numba are imported: both read their threads once.
    prepare(options.threads)
    import torch

    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    # Points on a sphere of diameter one: a surface, in the unit that the encoder sees.
    clouds_B_N_3 = torch.nn.functional.normalize(torch.randn(options.batch, options.points, 3), dim=-1) / 2
    networks = dict(zip(NETWORKS, make_networks(options.k, clouds_B_N_3), strict=True))
    error = max_abs_error(*networks.values(), clouds_B_N_3)
    seconds = {name: measure(name, networks, clouds_B_N_3, options.repeats) for name in PASSES}
    speedup = {name: median(a / b for a, b in zip(*seconds[name].values(), strict=True)) for name in PASSES}

    print(f"DGCNN, {options.batch} clouds of {options.points} points, k = {options.k}, {options.threads} thread(s),")
    print(f"{options.repeats} repeats in turn; ms per cloud: median (least)\n")
    print(f"{'':6}" + "".join(f"{network:>18}" for network in NETWORKS) + f"{'ratio of pairs':>18}")
    for name in PASSES:
        cells = [
            f"{1e3 * median(s) / options.batch:.2f} ({1e3 * min(s) / options.batch:.2f})"
            for s in seconds[name].values()
        ]
        print(f"{name:6}" + "".join(f"{cell:>18}" for cell in (*cells, f"{speedup[name]:.1f}")))
    print(f"\nlargest difference of an embedding: {error:.1e}")
    result = {"train_speedup": speedup["train"], "infer_speedup": speedup["infer"], "max_abs_error": error}
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"threads": 2, "batch": 16, "points": 512, "k": 20, "repeats": 5}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    options = parser.parse_args(arguments)
    if min(options.threads, options.batch, options.k, options.repeats) < 1 or options.points < options.k:
        parser.error("every number must be at least 1, and points at least k")
    return options


def make_networks(k: int, clouds_B_N_3):
    """Return the reference and the project's DGCNN with the same weights and running statistics."""
    from gpca.encoders.dgcnn import DGCNN

    fused = DGCNN(k).train()
    for _ in range(3):  # running statistics of these clouds instead of the initial zeros and ones
        fused(clouds_B_N_3)
    return per_edge_form(fused), fused


def per_edge_form(fused):
    """Return a DGCNN with one linear layer per edge that has the weights of the given one."""
    from copy import deepcopy

    from torch import nn

    from tests.encoders.per_edge import PerEdgeConv

    reference, layers = deepcopy(fused), []
    for layer in fused.edge_convs:
        per_edge = PerEdgeConv(layer.weight.shape[1] // 2, layer.weight.shape[0], layer.k)
        per_edge.linear.weight.data.copy_(layer.weight.data)
        per_edge.norm.load_state_dict(layer.norm.state_dict())
        layers.append(per_edge)
    reference.edge_convs = nn.ModuleList(layers)
    reference.forward = reference.by_layers  # arrays would be evaluated by our own loops
    return reference


def max_abs_error(reference, fused, clouds_B_N_3) -> float:
    import torch

    with torch.inference_mode():
        return float((fused.eval()(clouds_B_N_3) - reference.eval()(clouds_B_N_3)).abs().max())


def measure(name: str, networks: dict, clouds_B_N_3, repeats: int) -> dict[str, list[float]]:
    """Return the seconds of every repeat for each network; a first round of both, unmeasured, warms up."""
    step = {"train": training_step, "infer": inference}[name]
    seconds = {network: [] for network in networks}
    for repeat in range(repeats + 1):
        for network, module in networks.items():
            elapsed = step(module, clouds_B_N_3)
            if repeat > 0:
                seconds[network].append(elapsed)
    return seconds


def training_step(module, clouds_B_N_3) -> float:
    module.train().zero_grad()
    started = perf_counter()
    module(clouds_B_N_3).square().mean().backward()
    return perf_counter() - started


def inference(module, clouds_B_N_3) -> float:
    import torch

    module.eval()
    started = perf_counter()
    with torch.inference_mode():
        module(clouds_B_N_3)
    return perf_counter() - started


if __name__ == "__main__":
    main()
