"""All metrics of depth frames: of their explanations, and of learning from their labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.active_learning.metrics import TABLE, collect_curves
from gpca.attribution.metrics import ALL, source_method_seed, tidy
from gpca.errors import InputError
from gpca.experiments.frame_labels.settings import PAIR, in_percent
from gpca.experiments.real_world import metrics
from gpca.io.csv_file import numbers, read_csv

if TYPE_CHECKING:
    import pandas as pd

VALIDATION, CHOSEN = "validation", "chosen"  # in the column `table`
TO_TARGET = ("labels_to_target", "epochs_to_target", "reached")  # they differ by the target, all else does not


def collect(
    prediction_files: Iterable[str | Path],
    pose_files: Iterable[str | Path],
    one_encoder_files: Iterable[str | Path],
    label_files: Iterable[str | Path],
    curve_files: Iterable[str | Path],
    targets: Iterable[float],
) -> pd.DataFrame:
    """Return the tidy metrics of the depth frames and, below them, of :func:`collect_labels`."""
    import pandas as pd

    of_explanations = metrics.collect(prediction_files, pose_files, one_encoder_files)
    return pd.concat([of_explanations, *collect_labels(label_files, curve_files, targets)], ignore_index=True)


def collect_labels(
    label_files: Iterable[str | Path], curve_files: Iterable[str | Path], targets: Iterable[float]
) -> list[pd.DataFrame]:
    """Return the tidy metrics of learning curves on depth frames, and the validation accuracy of their encoders.

    The column `table` says of which embedding a curve is, ``active_learning/{backbone}`` or ``active_learning/pair``;
    what depends on the target accuracy has the target in percent after it, ``active_learning/{backbone}/70``.
    ``active_learning/chosen`` repeats the rows of the backbone with the largest mean validation accuracy, so that no
    test sample has a say in it; the first backbone where no encoder held samples out. ``validation`` has that accuracy,
    of the epoch whose weights were kept, with the backbone as `method`.

    Args:
        label_files: named ``…/{source}/{strategy}/seed{seed}.csv``.
        curve_files: of the encoders' training, named ``…/{source}/{backbone}/seed{seed}.csv``.
        targets: accuracies on the test samples.

    Raises:
        InputError: no files, a name of another form, what their readers refuse.
    """
    files = list(label_files)
    by_target = {in_percent(target): collect_curves(files, target) for target in targets}
    parts = [_of_target(curves, percent) for percent, curves in by_target.items()]
    whole = next(iter(by_target.values()))
    whole = whole[~whole["metric"].isin(TO_TARGET)]
    validated = _validation_accuracies(curve_files)
    chosen = chosen_backbone(_means(validated), _embeddings(whole))
    curves = [part for of in (whole, *parts) for part in (of, _repeated(of, chosen))]
    records = [(VALIDATION, *key[:2], "accuracy", ALL, key[2], value) for key, value in validated.items()]
    return [tidy(records, VALIDATION), *curves] if records else curves


def chosen_backbone(accuracies: Mapping[str, float], embeddings: Iterable[str]) -> str:
    """Return the embedding by a backbone with the largest accuracy, the first of equal ones.

    Args:
        accuracies: backbone -> mean validation accuracy; a backbone may be missing.
        embeddings: their names; the pair is no backbone.

    Raises:
        InputError: no backbone among the embeddings.
    """
    backbones = [name for name in embeddings if name != PAIR]
    if not backbones:
        raise InputError("learning curves of depth frames", "cover no backbone", "regenerate them")
    return max(backbones, key=lambda name: accuracies.get(name, 0.0))


def _of_target(curves: pd.DataFrame, percent: str) -> pd.DataFrame:
    of_target = curves[curves["metric"].isin(TO_TARGET)]
    return of_target.assign(table=of_target["table"] + f"/{percent}")


def _repeated(curves: pd.DataFrame, embedding: str) -> pd.DataFrame:
    """Return the rows of an embedding, renamed as those of the chosen one."""
    rows = curves[curves["table"].str.split("/").str[1] == embedding]
    return rows.assign(table=rows["table"].str.replace(f"{TABLE}{embedding}", f"{TABLE}{CHOSEN}", regex=False))


def _embeddings(curves: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(curves["table"].str.removeprefix(TABLE)))


def _validation_accuracies(curve_files: Iterable[str | Path]) -> dict[tuple[str, str, int], float]:
    """Return (source, backbone, seed) -> accuracy of the epoch with the smallest validation loss."""
    accuracies = {}
    for path in curve_files:
        curve = read_csv(path, ("epoch", "loss"), others=("learning_rate", "accuracy", "validation_*"))
        if "validation_loss" in curve:
            best = numbers(path, curve, "validation_loss").idxmin()
            accuracies[source_method_seed(path)] = float(numbers(path, curve, "validation_accuracy")[best])
    return accuracies


def _means(validated: Mapping[tuple[str, str, int], float]) -> dict[str, float]:
    of_backbone: dict[str, list[float]] = {}
    for (_, backbone, _), accuracy in validated.items():
        of_backbone.setdefault(backbone, []).append(accuracy)
    return {backbone: sum(values) / len(values) for backbone, values in of_backbone.items()}
