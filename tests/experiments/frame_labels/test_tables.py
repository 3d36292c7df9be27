import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.frame_labels.tables import table6_labels

CONDITIONS = {"targets": [0.65, 0.7], "held_out": ["overlap"], "initial": 10, "share": 0.05, "labels": 300}
CONDITIONS |= {"least": 60, "train": 600, "test": 300}
ENCODERS = {"dgcnn": "DGCNN", "pointnet": "PointNet", "pointnet2": "PointNet++"}


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
    table = table6_labels(metrics(), "frames", ENCODERS, CONDITIONS)
    assert [label for [(_, label)] in table.rows] == ["DGCNN", "PointNet++", "Measurements of the pair"]
    assert table.cells[0, "bald_kmeans_65"].mean == 10
    assert not table.cells[0, "bald_kmeans_65"].at_least
    assert table.cells[0, "random_65"].at_least
    assert table.cells[0, "bald_kmeans_70"].mean == 18
    assert table.cells[1, "random_70"].mean == 35
    assert table.cells[0, "all_labels"].mean == pytest.approx(85)
    markdown = table.markdown()
    assert "| > 50 |" in markdown
    assert "Mean over 2 seeds, 300 test samples each" in markdown
    assert "| BALD, to 65 % (labels) | Random, to 65 % (labels) |" in markdown
    assert "Bold: the fewer labels" in markdown
    for words in ("Start: 10 labeled samples", "5 % of it", "to 60 labels at least and 300 at most"):
        assert words in markdown


def test_metrics_without_learning_curves_are_refused():
    with pytest.raises(InputError, match="has nothing to show"):
        table6_labels(metrics().query("table == 'attribution'"), "frames", ENCODERS, CONDITIONS)
