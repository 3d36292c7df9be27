import pandas as pd
import pytest

from gpca.attribution.metrics import ALL, TIDY_COLUMNS
from gpca.errors import InputError
from gpca.experiments.specification_curve.frame_tables import table6_inputs


def rows(table, concept=ALL, **values):
    named = ("frame_input/" + table, "real_rgbd", "dgcnn-none")
    return [
        (*named, metric, concept, seed, v) for metric, of_seeds in values.items() for seed, v in enumerate(of_seeds)
    ]


def test_a_row_is_a_cloud_and_confusions_are_shares_of_the_concept():
    found = rows("aligned/all", accuracy=(0.7, 0.8), test_samples=(300, 300))
    found += rows("aligned/seen", accuracy=(0.9, 0.9), test_samples=(150, 150))
    found += rows("observed/all", accuracy=(0.5, 0.6), test_samples=(300, 300))
    found += rows("observed/all", "pose", accuracy=(0.4, 0.6), test_samples=(100, 50), predicted_as_overlap=(30, 10))
    table = table6_inputs(pd.DataFrame(found, columns=list(TIDY_COLUMNS)), "frames")
    assert [tuple(key for key, _ in row) for row in table.rows] == [
        ("dgcnn-none", "aligned"), ("dgcnn-none", "observed"),
    ]  # fmt: skip
    assert table.cells[0, "all"].mean == pytest.approx(75)
    assert table.cells[0, "seen"].mean == pytest.approx(90)
    assert table.cells[1, "pose_as_overlap"].mean == pytest.approx(25)
    assert (0, "pose_as_overlap") not in table.cells
    text = table.markdown()
    assert "| DGCNN | observed cloud before ICP |" in text
    assert "Mean over 2 seeds, the first of the run; with fewer than 3 there is no interval and no bold." in text
    assert "Test samples: all 600, seen 300." in text
    assert "±" not in text and table.best() == set()


def test_nothing_to_show_is_refused():
    with pytest.raises(InputError, match="has nothing to show"):
        table6_inputs(pd.DataFrame(rows("lost/all", accuracy=(1,)), columns=list(TIDY_COLUMNS)), "frames")
