"""Labels on depth frames: what they buy, by target and embedding."""

import pandas as pd
import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.frame_labels import collect_labels, table6_labels

# Accuracies after 0, 4, 8 labels.
ACCURACIES = {
    ("dgcnn", "bald_kmeans"): (0.6, 0.7, 0.8), ("dgcnn", "random"): (0.6, 0.65, 0.7),
    ("pointnet2", "bald_kmeans"): (0.5, 0.66, 0.69), ("pointnet2", "random"): (0.5, 0.5, 0.5),
    ("pair", "bald_kmeans"): (0.9, 0.9, 0.9), ("pair", "random"): (0.9, 0.9, 0.9),
}  # fmt: skip


def value(found, **wanted):
    rows = pd.concat(found)
    for column, text in wanted.items():
        rows = rows[rows[column] == text]
    [number] = rows["value"]
    return number


def test_labels_are_counted_to_every_target_and_the_rest_stands_once(tmp_path):
    label_files = []
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
        label_files.append(path)
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


FRAME_LABELS = {
    "targets": [0.65, 0.7],
    "held_out": ["overlap"],
    "initial": 10,
    "share": 0.05,
    "labels": 300,
    "least": 60,
}
FRAMES = {"train": 600, "test": 300, "title": "frames", "datasets": {"lmo": {}}}
RUN = Run({"frame_labels": FRAME_LABELS, "real_world": FRAMES | {"backbones": ["dgcnn", "pointnet", "pointnet2"]}})


def rows(table, strategy, metric, *of_seeds):
    values = enumerate(of_seeds)
    return [(f"active_learning/{table}", "real_rgbd", strategy, metric, "overlap", seed, v) for seed, v in values]


def metrics():
    found = rows("dgcnn/65", "bald_kmeans", "labels_to_target", 8, 12)
    found += rows("dgcnn/65", "bald_kmeans", "reached", 1, 1)
    found += rows("dgcnn/65", "random", "labels_to_target", 20, 80) + rows("dgcnn/65", "random", "reached", 1, 0)
    found += rows("dgcnn/70", "bald_kmeans", "labels_to_target", 16, 20)
    found += rows("dgcnn", "all_labels", "final_accuracy", 0.8, 0.9)
    found += rows("pointnet2/70", "random", "labels_to_target", 30, 40)
    found += rows("pair", "all_labels", "final_accuracy", 1.0, 1.0)
    return pd.DataFrame(found, columns=list(TIDY_COLUMNS))


def test_a_row_is_what_the_samples_are_seen_by():
    table = table6_labels(RUN, metrics())
    assert [label for [(_, label)] in table.rows] == ["DGCNN", "PointNet++", "Measurements of the pair"]
    assert table.cells[0, "bald_kmeans_65"].mean == 10
    assert not table.cells[0, "bald_kmeans_65"].at_least
    assert table.cells[0, "random_65"].at_least
    assert table.cells[0, "bald_kmeans_70"].mean == 18
    assert table.cells[1, "random_70"].mean == 35
    assert table.cells[0, "all_labels"].mean == pytest.approx(85)
    markdown = table.markdown()
    assert "| > 50 |" in markdown
    assert table.caption.endswith("to which overlap is new is as accurate on frames")
    assert "Mean over 2 seeds, 300 test samples each" in markdown
    assert "| BALD, to 65 % (labels) | Random, to 65 % (labels) |" in markdown
    assert "Bold: the fewer labels" in markdown
    for words in ("Start: 10 labeled samples", "5 % of it", "to 60 labels at least and 300 at most"):
        assert words in markdown
    with pytest.raises(InputError, match="has nothing to show"):
        table6_labels(RUN, metrics().query("table == 'attribution'"))
