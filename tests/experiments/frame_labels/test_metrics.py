"""What labels of depth frames buy, by target and backbone, and that validation alone chooses the backbone."""

import pandas as pd
import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.errors import InputError
from gpca.experiments.frame_labels.metrics import collect_labels

# Accuracies after 0, 4, 8 labels.
ACCURACIES = {
    ("dgcnn", "bald_kmeans"): (0.6, 0.7, 0.8), ("dgcnn", "random"): (0.6, 0.65, 0.7),
    ("pointnet", "bald_kmeans"): (0.5, 0.66, 0.69), ("pointnet", "random"): (0.5, 0.5, 0.5),
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


def training(tmp_path, backbone, seed=0, **columns):
    path = tmp_path / f"encoders/real_rgbd/{backbone}/seed{seed}.csv"
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame({"epoch": [1, 2], "loss": [1.0, 0.5], **columns}).to_csv(path, index=False)
    return path


def value(found, **wanted):
    rows = pd.concat(found)
    for column, text in wanted.items():
        rows = rows[rows[column] == text]
    [number] = rows["value"]
    return number


def test_labels_are_counted_to_every_target_and_the_rest_stands_once(tmp_path, label_files):
    found = collect_labels(label_files, [], (0.65, 0.7))
    labels = {"method": "bald_kmeans", "metric": "labels_to_target"}
    assert value(found, table="active_learning/dgcnn/70", **labels) == 4
    assert value(found, table="active_learning/pointnet/65", **labels) == 4
    assert value(found, table="active_learning/pointnet/70", **labels) == 8
    assert value(found, table="active_learning/pointnet/70", method="bald_kmeans", metric="reached") == 0
    assert value(found, table="active_learning/dgcnn", method="random", metric="final_accuracy") == 0.7
    assert "final_accuracy" not in set(pd.concat(found).query("table == 'active_learning/dgcnn/70'")["metric"])


def test_validation_chooses_the_backbone_whatever_the_test_samples_say(tmp_path, label_files):
    """The last epoch of PointNet is worse; what counts is the epoch whose weights were kept."""
    kept = {"validation_loss": [0.4, 0.6], "validation_accuracy": [0.9, 0.1]}
    other = {"validation_loss": [0.6, 0.5], "validation_accuracy": [0.9, 0.8]}
    curves = [training(tmp_path, "dgcnn", **other), training(tmp_path, "pointnet", **kept)]
    found = collect_labels(label_files, curves, (0.65,))
    for method in ("bald_kmeans", "random"):
        wanted = {"method": method, "metric": "labels_to_target"}
        expected = value(found, table="active_learning/pointnet/65", **wanted)
        assert value(found, table="active_learning/chosen/65", **wanted) == expected
    assert value(found, table="active_learning/chosen", method="random", metric="final_accuracy") == 0.5
    assert value(found, table="validation", method="dgcnn") == 0.8


def test_curves_of_no_backbone_are_refused(tmp_path):
    path = tmp_path / "frame_labels/real_rgbd/random/seed0.csv"
    path.parent.mkdir(parents=True)
    step = {"labels": 0, "new_labels": 0, "accuracy": 1, "accuracy_new": 1, "epochs": 0}
    write_curves(path, {("pair", "overlap"): [step]}, POOL_COLUMNS)
    with pytest.raises(InputError, match="learning curves of depth frames: cover no backbone"):
        collect_labels([path], [], (0.7,))


def test_without_validation_it_is_the_first_backbone(tmp_path, label_files):
    found = collect_labels(label_files, [training(tmp_path, "pointnet")], (0.65,))
    assert value(found, table="active_learning/chosen", method="random", metric="final_accuracy") == 0.7
    assert "validation" not in set(pd.concat(found)["table"])
