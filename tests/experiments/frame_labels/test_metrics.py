"""What labels of depth frames buy, by target and embedding."""

import pandas as pd
import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.experiments.frame_labels.metrics import collect_labels

# Accuracies after 0, 4, 8 labels.
ACCURACIES = {
    ("dgcnn", "bald_kmeans"): (0.6, 0.7, 0.8), ("dgcnn", "random"): (0.6, 0.65, 0.7),
    ("pointnet2", "bald_kmeans"): (0.5, 0.66, 0.69), ("pointnet2", "random"): (0.5, 0.5, 0.5),
    ("pair", "bald_kmeans"): (0.9, 0.9, 0.9), ("pair", "random"): (0.9, 0.9, 0.9),
}  # fmt: skip


@pytest.fixture
def label_files(tmp_path):
    paths = []
    for strategy in ("bald_kmeans", "random"):
        path = tmp_path / f"frame_labels/real_rgbd/{strategy}/seed0.csv"
        path.parent.mkdir(parents=True)
        curves = {
            (name, "overlap"): [
                {"labels": 4 * i, "new_labels": i, "accuracy": a, "accuracy_new": a, "epochs": 2 * i}
                for i, a in enumerate(accuracies)
            ]
            for (name, of), accuracies in ACCURACIES.items()
            if of == strategy
        }
        write_curves(path, curves, POOL_COLUMNS)
        paths.append(path)
    return paths


def value(found, **wanted):
    rows = pd.concat(found)
    for column, text in wanted.items():
        rows = rows[rows[column] == text]
    [number] = rows["value"]
    return number


def test_labels_are_counted_to_every_target_and_the_rest_stands_once(label_files):
    found = collect_labels(label_files, (0.65, 0.7))
    labels = {"method": "bald_kmeans", "metric": "labels_to_target"}
    assert value(found, table="active_learning/dgcnn/70", **labels) == 4
    assert value(found, table="active_learning/pointnet2/65", **labels) == 4
    assert value(found, table="active_learning/pointnet2/70", **labels) == 8
    assert value(found, table="active_learning/pointnet2/70", method="bald_kmeans", metric="reached") == 0
    assert value(found, table="active_learning/pair/70", method="random", metric="labels_to_target") == 0
    assert value(found, table="active_learning/dgcnn", method="random", metric="final_accuracy") == 0.7
    metrics = pd.concat(found)
    assert "final_accuracy" not in set(metrics.query("table == 'active_learning/dgcnn/70'")["metric"])
    assert "epochs_at_target" not in set(metrics["metric"])  # counted to a single target alone
