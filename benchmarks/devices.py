"""Encoders on a CUDA device against the CPU: how long training and embedding take, and how far they agree.

    python benchmarks/devices.py registrations/…/seed100.npz [--backbones dgcnn …] [--epochs 3] [--devices cpu cuda]

The file holds registrations, as of `snakemake … --configfile config/development.yaml`; settings are those of the
config's `encoders`. Each backbone is trained on both devices from the same weights on the same draws; a short training
before it takes what is done once. The last line is a JSON object: for each backbone train_speedup_ and embed_speedup_,
first_loss_ (largest relative difference of an epoch's loss, in the first), accuracy_ (difference of the last epoch, in
points) and max_abs_error_ of embeddings by the same weights, relative to their largest number.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from unittest.mock import patch

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    prepare(1)
    import torch
    import yaml

    from gpca.encoders.registry import EncoderSettings
    from gpca.pairs.dataset import Registrations

    if "cuda" in options.devices and not torch.cuda.is_available():
        print("devices: torch finds no CUDA device; run it where there is one", file=sys.stderr)
        return 2
    registrations = Registrations.load(options.registrations)
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    found = {}
    print(f"{'':12}{'training (s)':>26}{'embedding (s)':>26}{'loss':>10}{'points':>8}{'error':>10}")
    for backbone in options.backbones:
        settings = replace(EncoderSettings(**config["encoders"][backbone]), epochs=options.epochs)
        measured = compare(registrations, settings, options.devices)
        seconds = "".join(f"{f'{measured[name][0]:.1f} / {measured[name][1]:.1f}':>26}" for name in ("train", "embed"))
        agreement = (measured["first_loss"], measured["accuracy"], measured["max_abs_error"])
        print(f"{backbone:12}{seconds}" + "{:10.1e}{:8.1f}{:10.1e}".format(*agreement))
        for name in ("train", "embed"):
            found[f"{name}_speedup_{backbone}"] = measured[name][0] / measured[name][1]
        found |= {f"{name}_{backbone}": measured[name] for name in ("first_loss", "accuracy", "max_abs_error")}
    print(json.dumps({name: float(f"{value:.4g}") for name, value in found.items()}))
    return 0


def compare(registrations, settings, devices: list[str]) -> dict:
    """Return seconds on both devices, and the differences of losses, accuracies and embeddings."""
    import numpy as np
    import torch

    from gpca.encoders import training

    seconds: dict[str, list[float]] = {"train": [], "embed": []}
    curves, embeddings, model = [], [], None
    for name in devices:
        with patch.object(training, "best_device", lambda name=name: torch.device(name)):
            training.train_encoder(registrations, "devices", 0, replace(settings, epochs=1))
            start = perf_counter()
            own, curve = training.train_encoder(registrations, "devices", 0, settings)
            seconds["train"].append(perf_counter() - start)
            curves.append(curve)
            model = model or own
            start = perf_counter()
            embeddings.append(training.embed(model, registrations, "devices", 0, settings)[0])
            seconds["embed"].append(perf_counter() - start)
    one, other = curves
    return seconds | {
        "first_loss": abs(one[0]["loss"] - other[0]["loss"]) / one[0]["loss"],
        "accuracy": 100 * abs(one[-1]["accuracy"] - other[-1]["accuracy"]),
        "max_abs_error": float(np.abs(embeddings[0] - embeddings[1]).max() / np.abs(embeddings[0]).max()),
    }


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("registrations", type=Path)
    parser.add_argument("--backbones", nargs="+", default=["dgcnn", "pointnet", "pointnet2", "pointnext"])
    parser.add_argument("--epochs", type=int, default=3, help="default 3")
    parser.add_argument("--devices", nargs=2, default=["cpu", "cuda"], help="default cpu cuda")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
