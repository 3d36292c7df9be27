"""Seconds that every explainer takes for one sample, and the share of them that is spent inside ICP.

    python benchmarks/explainers.py [--samples 12] [--starts 50] [--points 512]

Everything runs in one process on one thread, on registrations of the procedural coffee cups, of 2048 points each, with
`starts` initial poses and `points` points per Monte-Carlo run for every design. Counted is what one sample takes from
the clouds on: ICP of the observed pair, the conditions that the explainer needs, embedding, its own arithmetic; not
fitting, and not the loading of libraries. The encoder has random weights, which changes no time. What shares conditions
with another (all of `removal`, say) is charged in full. The first table compares ICP from many initial poses with as
many calls of Open3D, in turn (A B A B …); the ratio is the median over the pairs of clouds. The last line is a JSON
object: icp_speedup, icp_max_abs_error (of a pose), and seconds_<explainer>, icp_share_<explainer>.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

SEED, SOURCE = 0, "coffee_cup"
GPC_SETTINGS = {"iterations": 20}  # of the fit, which is not measured


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare()
    registrations, icp_seconds_S = make_registrations(options.samples)
    from gpca.uncertainty.settings import UncertaintySettings

    settings = UncertaintySettings(starts=options.starts, icp_points=options.points)
    speedup, error = compare_icp(registrations, settings)
    print(f"\nICP from {options.starts} initial poses, {options.points} points: {speedup:.1f} times as fast as Open3D")
    print(f"called for each; largest difference of a pose: {error:.1e}\n")
    result = {"icp_speedup": speedup, "icp_max_abs_error": error}
    print(f"{'explainer':28}{'ICP calls':>10}{'s / sample':>12}{'in ICP':>9}")
    for name, (calls, seconds, share) in measure(registrations, icp_seconds_S, settings).items():
        print(f"{name:28}{calls:10.0f}{seconds:12.4f}{100 * share:7.0f} %")
        result |= {f"seconds_{name}": seconds, f"icp_share_{name}": share}
    print(json.dumps({key: float(f"{value:.4g}") for key, value in result.items()}))


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in {"samples": 12, "starts": 50, "points": 512}.items():
        parser.add_argument(f"--{name}", type=int, default=default, help=f"default {default}")
    options = parser.parse_args(arguments)
    if options.samples < 6 or options.samples % 3:
        parser.error("samples must be a multiple of 3, and at least 6")
    return options


def make_registrations(samples: int):
    """Return as many training as test registrations, and the seconds of ICP of each."""
    from gpca.objects.canonical import ObjectClouds, write_objects
    from gpca.objects.source import resolve, surfaces
    from gpca.pairs.synthesis import RegistrationSettings
    from gpca.pairs.synthesis import make_registrations as make

    with tempfile.TemporaryDirectory() as folder:
        entry = resolve({"kind": "procedural", "family": SOURCE, "title": SOURCE}, None)
        write_objects(surfaces(entry, Path(folder)), SOURCE, Path(folder, "objects.npz"), n_points=4096)
        objects = ObjectClouds.load(Path(folder, "objects.npz"))
    return make(objects, SOURCE, SEED, RegistrationSettings(train=samples, test=samples))


def compare_icp(registrations, settings) -> tuple[float, float]:
    """Return how many times as fast the batched runs are, and the largest difference of a pose."""
    import numpy as np

    from gpca.alignment.batched_icp import BatchedICP
    from gpca.alignment.icp import ICP
    from gpca.rigid import exp
    from gpca.uncertainty.designs import RegisteredRow

    starts_n = exp(np.random.default_rng(SEED).normal(size=(settings.starts, 6)) * settings.deviation_6())
    ratios, errors = [], []
    for row in registrations.rows("test"):
        source, target, T_init, _ = RegisteredRow(registrations, row).observed(
            settings.icp_points, np.random.default_rng(row)
        )
        poses_n = starts_n @ T_init
        started = perf_counter()
        batched_n, *_ = BatchedICP(target, settings.icp).register(source, poses_n)
        halfway = perf_counter()
        icp = ICP(target, None, settings.icp)
        single_n = np.array([icp.register(source, pose).T_target_source for pose in poses_n])
        ratios.append((perf_counter() - halfway) / (halfway - started))
        errors.append(float(np.abs(batched_n - single_n).max()))
    return median(ratios[1:]), max(errors)  # the first one waited for the compiler


def measure(registrations, icp_seconds_S, settings) -> dict[str, tuple[float, float, float]]:
    """Return for every explainer ICP calls and seconds per test sample, and the share of ICP."""
    import inspect

    from gpca.explainers.registry import explainers
    from gpca.uncertainty.designs import DESIGNS, design_rows, evaluate_design

    prepared = {"registrations": with_seconds(registrations, icp_seconds_S)}
    prepared["embeddings"] = embedded(prepared["registrations"])
    for design in DESIGNS:
        chosen = prepared["registrations"].subset(design_rows(registrations, design, None))
        outcomes, *seconds = evaluate_design(design, chosen, SOURCE, SEED, settings)
        prepared[f"uncertainty/{design}"] = outcomes.attach_to(prepared["registrations"], *seconds)
    measured = {}
    for name, entry in explainers().items():
        given = prepared[entry.reads]
        takes = inspect.signature(entry.make).parameters
        own = GPC_SETTINGS if "settings" in takes or "iterations" in takes else {}
        explainer = entry.make(SOURCE, SEED, **own)
        if len(train := given.rows("train")):
            explainer.fit(given.subset(train))
        test = given.subset(given.rows("test"))
        explainer.explain(test)  # what it loads when it is first asked
        attribution = explainer.explain(test)
        seconds = float((test.attached["earlier_seconds"] + attribution.seconds_N).mean())
        icp_seconds = float((test.attached["earlier_icp_seconds"] + attribution.icp_seconds_N).mean())
        measured[name] = float(attribution.icp_calls_N.mean()), seconds, icp_seconds / seconds
    return measured


def with_seconds(registrations, icp_seconds_S):
    """Attach the seconds of the observed registrations, all of them inside ICP."""
    from dataclasses import replace

    return replace(registrations, attached={"earlier_seconds": icp_seconds_S, "earlier_icp_seconds": icp_seconds_S})


def embedded(registrations):
    """Attach embeddings of a DGCNN with random weights, and count the seconds that they took."""
    from collections import OrderedDict
    from dataclasses import replace

    import torch

    from gpca.encoders.registry import EncoderSettings, make_encoder
    from gpca.encoders.training import embed
    from gpca.pairs.perturbation import CONCEPTS

    torch.set_num_threads(1)
    encoder = make_encoder("dgcnn", {})
    model = torch.nn.Sequential(
        OrderedDict(encoder=encoder, head=torch.nn.Linear(encoder.embedding_size, len(CONCEPTS)))
    )
    embed(model, registrations.subset(registrations.rows("test")[:1]), SOURCE, SEED, EncoderSettings())
    started = perf_counter()
    h_S_d, logits_S_C = embed(model, registrations, SOURCE, SEED, EncoderSettings())
    earlier = registrations.attached["earlier_seconds"] + (perf_counter() - started) / len(registrations)
    attached = {**registrations.attached, "earlier_seconds": earlier, "embedding": h_S_d, "head_logits": logits_S_C}
    return replace(registrations, attached=attached)


if __name__ == "__main__":
    main()
