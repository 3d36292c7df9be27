"""How many epochs an encoder needs: accuracy and loss of trainings of different lengths, on development objects.

    python benchmarks/convergence.py [registrations/…/seed*.npz] [causes/…/seed*.npz] [--backbones dgcnn pointnet]
        [--epochs 3 6 12 24 48] [--out convergence.csv] [--write docs/appendix.md]

Each length is a training of its own, since the one-cycle schedule spans it; one that was ended resumes. Files are
registrations of development objects, or those with measured causes (`snakemake … --configfile
config/development.yaml`, seeds of 100 and more); settings are those of the config's `encoders`, or `diagnosis.encoder`.
Rows of --out: backbone ("causes" for the latter), epochs, seed, loss and accuracy of the last epoch, accuracy of the
head and of the GPC with the paper's settings on the test samples, seconds of the training (of the last part), device.
A row that is there is not computed again; without files, those rows are only summed up. --write puts table and
figure into that page, which states the rule. The last line is a JSON object: converged_<backbone>, the first length
that no longer one improves; null if only the longest is such.
"""

import argparse
import csv
import json
import sys
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks import markdown  # noqa: E402 (the script runs from a plain checkout)
from gpca.process.processor import prepare  # noqa: E402

COLUMNS = ("backbone", "epochs", "seed", "loss", "train_accuracy", "head_accuracy", "gpc_accuracy", "seconds", "device")
MEASURES = ("head_accuracy", "gpc_accuracy")
CAUSES = "causes"
FALL, RISE = 0.05, 0.002  # of the loss in nats, and of an accuracy, below which nothing moves
CHECKPOINTS = ROOT / "build/convergence"


def main(arguments: list[str] | None = None) -> None:
    options = parse(arguments)
    prepare(1)
    done = read_rows(options.out)
    for path in options.files:
        of_causes, seed = path.parent.parent.name == CAUSES, path.stem.removeprefix("seed")
        for name in [CAUSES] if of_causes else options.backbones:
            for epochs in options.epochs:
                if (name, str(epochs), seed) not in {tuple(row[c] for c in COLUMNS[:3]) for row in done}:
                    done.append(trained(path, name, int(seed), epochs))
                    write_rows(options.out, done)
                    print(*done[-1].values(), file=sys.stderr)
    lines, found = summary(done)
    if options.write:
        figure = draw(done, options.write.with_name("convergence.png"))
        markdown.write_between(options.write, "convergence", [*lines, "", figure])
    print("\n".join(lines))
    print(json.dumps(found))


def trained(path: Path, name: str, seed: int, epochs: int) -> dict[str, str]:
    """Return the row of one training on the samples of a file."""
    from dataclasses import replace

    import numpy as np
    import torch
    import yaml

    from gpca.causes.dataset import LABELS, Causes, with_label
    from gpca.classifier.gpc import GPC
    from gpca.classifier.settings import GPCSettings
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import best_device, embed, train_encoder
    from gpca.pairs.dataset import Registrations
    from gpca.pairs.perturbation import CONCEPTS

    torch.set_num_threads(1)
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    of_causes = name == CAUSES
    registrations = with_label(Causes.load(path)) if of_causes else Registrations.load(path)
    classes = LABELS if of_causes else CONCEPTS
    encoder = config["diagnosis"]["encoder"] if of_causes else config["encoders"][name]
    settings = replace(EncoderSettings(**encoder), epochs=epochs)
    source = path.parent.name
    CHECKPOINTS.mkdir(parents=True, exist_ok=True)
    checkpoint = CHECKPOINTS / f"{name}_{epochs}_{seed}"
    start = perf_counter()
    model, curve = train_encoder(registrations, source, seed, settings, checkpoint, classes)
    seconds = perf_counter() - start
    h_S_d, logits_S_C = embed(model, registrations, source, seed, settings)
    train, test = registrations.rows("train"), registrations.rows("test")
    labels_S = registrations.concept
    scores_N_C = GPC(classes, GPCSettings(), source, seed).fit(h_S_d[train], labels_S[train]).attribute(h_S_d[test])[0]
    values = {
        "loss": curve[-1]["loss"],
        "train_accuracy": curve[-1]["accuracy"],
        "head_accuracy": (np.array(classes)[logits_S_C[test].argmax(axis=1)] == labels_S[test]).mean(),
        "gpc_accuracy": (np.array(classes)[scores_N_C.argmax(axis=1)] == labels_S[test]).mean(),
        "seconds": seconds,
    }
    checkpoint.unlink(missing_ok=True)
    names = {"backbone": name, "epochs": str(epochs), "seed": str(seed)}
    return names | {name: f"{value:.6g}" for name, value in values.items()} | {"device": best_device().type}


def summary(rows: list[dict[str, str]]) -> tuple[list[str], dict[str, int | None]]:
    """Return a table of means over seeds, and the first converged length of each backbone; None if it is the last."""
    lines, converged = [], {}
    for name, by_length in lengths_of(rows).items():
        lengths = list(by_length)
        first = next(
            (a for a in lengths[:-1] if not any(moves(by_length[b], by_length[a]) for b in lengths if b > a)), None
        )
        converged[f"converged_{name}"] = first
        for length, by_seed in by_length.items():
            shares = [f"{100 * mean(by_seed, measure):.1f}" for measure in MEASURES]
            number = f"**{length}**" if length == first else length
            lines.append((name, number, len(by_seed), f"{mean(by_seed, 'loss'):.3f}", *shares))
    head = ("encoder", "epochs", "seeds", "training loss", "accuracy of the head (%)", "of the GPC (%)")
    return markdown.table(head, lines), converged


def draw(rows: list[dict[str, str]], path: Path) -> str:
    """Draw loss and accuracies over the epochs; return the line that shows the picture."""
    from gpca.reporting.figures.style import PALETTE, TEXT_WIDTH_IN, save_png, use_style

    figure, panels = use_style().subplots(1, 3, figsize=(TEXT_WIDTH_IN, 2.2), layout="constrained")
    titles = ("Training loss (nats)", "Accuracy of the head (%)", "Accuracy of the GPC (%)")
    for panel, measure, title in zip(panels, ("loss", *MEASURES), titles, strict=True):
        factor = 1 if measure == "loss" else 100
        for color, (name, by_length) in zip(PALETTE, lengths_of(rows).items(), strict=False):
            values = [factor * mean(by_seed, measure) for by_seed in by_length.values()]
            panel.plot(list(by_length), values, "o-", color=color, label=name, markersize=3)
        panel.set(title=title, xlabel="epochs", xscale="log")
        panel.set_xticks(ticks := sorted({int(row["epochs"]) for row in rows}), [str(tick) for tick in ticks])
        panel.minorticks_off()
    panels[0].legend()
    save_png(figure, path, dpi=110)
    return f"![Training loss and development accuracies over the number of epochs]({path.name})"


def lengths_of(rows: list[dict[str, str]]) -> dict[str, dict[int, dict[str, dict[str, str]]]]:
    """Return backbone -> epochs, ascending -> seed -> row."""
    found: dict[str, dict[int, dict[str, dict[str, str]]]] = {}
    for row in sorted(rows, key=lambda row: int(row["epochs"])):
        found.setdefault(row["backbone"], {}).setdefault(int(row["epochs"]), {})[row["seed"]] = row
    return {name: found[name] for name in dict.fromkeys(row["backbone"] for row in rows)}


def mean(by_seed: dict[str, dict], measure: str) -> float:
    """Return the mean of a column over the seeds."""
    return sum(float(row[measure]) for row in by_seed.values()) / len(by_seed)


def moves(longer: dict[str, dict], shorter: dict[str, dict]) -> bool:
    """Return whether the longer training is better, in its loss or in an accuracy, by the rule of docs/appendix.md.

    With one seed, the loss alone decides; of lengths without a common seed, nothing shows that they are alike.
    """
    import numpy as np

    if not (seeds := sorted(set(longer) & set(shorter))):
        return True
    gain_3_R = np.array([[float(longer[s][m]) - float(shorter[s][m]) for s in seeds] for m in ("loss", *MEASURES)])
    loss_R, *accuracies_R = gain_3_R
    errors = [2 * gain_R.std(ddof=1) / len(seeds) ** 0.5 for gain_R in accuracies_R] if len(seeds) > 1 else [np.inf] * 2
    rises = [gain_R.mean() > max(RISE, error) for gain_R, error in zip(accuracies_R, errors, strict=True)]
    return bool(loss_R.mean() <= -FALL or any(rises))


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
    parser.add_argument("files", nargs="*", type=Path, help="files …/{source}/seed{seed}.npz")
    parser.add_argument("--backbones", nargs="+", default=["dgcnn", "pointnet", "pointnet2", "pointnext"])
    parser.add_argument("--epochs", nargs="+", type=int, default=[3, 6, 12, 24, 48, 96])
    parser.add_argument("--out", type=Path, help="CSV that is continued")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="Markdown page with a place for table and figure")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    main()
