"""How many epochs an encoder needs: accuracy and loss of trainings of different lengths, on development objects.

    python benchmarks/convergence.py [registrations/…/seed*.npz] [--backbones dgcnn pointnet] [--epochs 3 6 12 24 48]
        [--out convergence.csv]

Each length is a training of its own, since the one-cycle schedule spans it. Files are registrations of development
objects (`snakemake … --configfile config/development.yaml`, seeds of 100 and more); settings are those of the config's
`encoders`. Rows of --out: backbone, epochs, seed, loss and accuracy of the last epoch, accuracy of the head and of the
GPC with the paper's settings on the test samples, seconds of the training, device. A row that is there is not
computed again; without registrations, those rows are only summed up. The last line is a JSON object:
converged_<backbone>, the first length that no longer one exceeds, in either accuracy, by more than two standard errors
of the paired difference over seeds and 0.2 points; null if only the longest is such.

"""

import argparse
import csv
import json
import sys
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from gpca.process.processor import prepare

COLUMNS = ("backbone", "epochs", "seed", "loss", "train_accuracy", "head_accuracy", "gpc_accuracy", "seconds", "device")
MEASURES = ("head_accuracy", "gpc_accuracy")


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare(1)
    import torch

    from gpca.pairs.dataset import Registrations

    torch.set_num_threads(1)
    done = read_rows(options.out)
    for path in options.registrations:
        registrations, seed = Registrations.load(path), int(path.stem.removeprefix("seed"))
        for backbone in options.backbones:
            for epochs in options.epochs:
                if (backbone, str(epochs), str(seed)) not in {tuple(row[c] for c in COLUMNS[:3]) for row in done}:
                    done.append(trained(registrations, path.parent.name, seed, backbone, epochs))
                    write_rows(options.out, done)
                    print(*done[-1].values(), file=sys.stderr)
    print(json.dumps(summary(done)))


def trained(registrations, source: str, seed: int, backbone: str, epochs: int) -> dict[str, str]:
    """Row of one training."""
    from dataclasses import replace

    import numpy as np
    import yaml

    from gpca.classifier.gpc import GPC
    from gpca.classifier.settings import GPCSettings
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import best_device, embed, train_encoder
    from gpca.pairs.perturbation import CONCEPTS

    config = yaml.safe_load((Path(__file__).resolve().parent.parent / "config/config.yaml").read_text())
    encoder = config["encoders"][backbone]
    settings = replace(EncoderSettings(**encoder), epochs=epochs)
    start = perf_counter()
    model, curve = train_encoder(registrations, source, seed, settings)
    seconds = perf_counter() - start
    h_S_d, logits_S_C = embed(model, registrations, source, seed, settings)
    train, test = registrations.rows("train"), registrations.rows("test")
    labels_S = registrations.concept
    classes = np.array(CONCEPTS)
    gpc = GPC(CONCEPTS, GPCSettings(), source, seed).fit(h_S_d[train], labels_S[train])
    scores_N_C = gpc.scores(h_S_d[test])
    values = {
        "loss": curve[-1]["loss"],
        "train_accuracy": curve[-1]["accuracy"],
        "head_accuracy": (classes[logits_S_C[test].argmax(axis=1)] == labels_S[test]).mean(),
        "gpc_accuracy": (classes[scores_N_C.argmax(axis=1)] == labels_S[test]).mean(),
        "seconds": seconds,
    }
    names = {"backbone": backbone, "epochs": str(epochs), "seed": str(seed)}
    return names | {name: f"{value:.6g}" for name, value in values.items()} | {"device": best_device().type}


def summary(rows: list[dict[str, str]]) -> dict[str, int | None]:
    """First converged length of each backbone; None if the longest is still better than all others."""
    import numpy as np

    converged = {}
    for backbone in dict.fromkeys(row["backbone"] for row in rows):
        chosen = [row for row in rows if row["backbone"] == backbone]
        lengths = sorted({int(row["epochs"]) for row in chosen})
        print(
            f"\n{backbone:10}{'epochs':>8}{'loss':>10}{'head':>8}{'GPC':>8}{'s':>8}   mean over seeds, accuracies in %"
        )
        by_length = {length: {row["seed"]: row for row in chosen if int(row["epochs"]) == length} for length in lengths}
        for length, by_seed in by_length.items():
            mean = {name: np.mean([float(row[name]) for row in by_seed.values()]) for name in COLUMNS[3:8]}
            shares = "".join(f"{100 * mean[name]:8.1f}" for name in MEASURES)
            print(f"{'':10}{length:8}{mean['loss']:10.4f}{shares}{mean['seconds']:8.1f}")
        converged[f"converged_{backbone}"] = next(
            (a for a in lengths[:-1] if not any(is_better(by_length[b], by_length[a]) for b in lengths if b > a)), None
        )
    return converged


def is_better(longer: dict[str, dict], shorter: dict[str, dict]) -> bool:
    """Whether either accuracy is higher by 0.2 points and two standard errors of the paired difference over seeds."""
    import numpy as np

    seeds = sorted(set(longer) & set(shorter))
    for name in MEASURES:
        gain_R = np.array([float(longer[seed][name]) - float(shorter[seed][name]) for seed in seeds])
        if len(seeds) > 1 and gain_R.mean() > max(0.002, 2 * gain_R.std(ddof=1) / len(seeds) ** 0.5):
            return True
    return False


def read_rows(path: Path | None) -> list[dict[str, str]]:
    if path is None or not path.is_file():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def write_rows(path: Path | None, rows: list[dict[str, str]]) -> None:
    if path is not None:
        with path.open("w", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("registrations", nargs="*", type=Path, help="files …/{source}/seed{seed}.npz")
    parser.add_argument("--backbones", nargs="+", default=["dgcnn", "pointnet", "pointnet2", "pointnext"])
    parser.add_argument("--epochs", nargs="+", type=int, default=[3, 6, 12, 24, 48, 96])
    parser.add_argument("--out", type=Path, help="CSV that is continued")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main()
