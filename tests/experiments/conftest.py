"""Files that tests of several experiments read."""

import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves


def _curve(rounds, best):
    return [
        {"labels": 4 * n, "new_labels": n, "accuracy": 0.5 + best * n / rounds, "accuracy_new": 0.5, "epochs": 1}
        for n in range(rounds + 1)
    ]


@pytest.fixture
def rare_files(tmp_path):
    """Learning curves of two strategies, with a rare concept, new causes, and an oracle that errs."""
    paths = [tmp_path / "ycb" / strategy / "seed0.csv" for strategy in ("bald_kmeans", "random")]
    for path in paths:
        path.parent.mkdir(parents=True)
        curves = {
            ("pretrained", "overlap"): _curve(3, 0.4),
            ("pretrained", "noise"): _curve(3, 0.2),
            ("rare_5", "overlap"): _curve(6, 0.3),
            ("pair", "overlap"): _curve(3, 0.5),
            ("pair_errors_10", "overlap"): _curve(3, 0.1),
            ("pair", "nominal"): _curve(3, 0.2),
        }
        write_curves(path, curves, POOL_COLUMNS)
    return paths
