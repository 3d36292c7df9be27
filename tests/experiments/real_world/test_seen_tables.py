import pandas as pd
import pytest

from gpca.attribution.metrics import ALL, TIDY_COLUMNS
from gpca.errors import InputError
from gpca.experiments.real_world.seen_tables import table6_seen_unseen

CONDITIONS = {"real_rgbd": "True pose", "real_rgbd_estimated": "Pose estimators"}


def metrics(values):
    rows = []
    for (source, table, method), of_seeds in values.items():
        for seed, (accuracy, samples) in enumerate(of_seeds):
            rows += [(table, source, method, "accuracy", ALL, seed, accuracy)]
            rows += [(table, source, method, "test_samples", ALL, seed, samples)]
            rows += [(table, source, method, "ece", ALL, seed, 0.1), (table, source, method, "nll", ALL, seed, 1.5)]
    return pd.DataFrame(rows, columns=list(TIDY_COLUMNS))


def make(values, **options):
    explainers = {"gpca_pair": "GP-CA on the pair"}
    return table6_seen_unseen(metrics(values), "frames", CONDITIONS, ["dgcnn-none"], explainers, **options)


def test_rows_are_conditions_by_methods_and_columns_what_was_seen():
    table = make(
        {
            ("real_rgbd", "attribution", "dgcnn-none"): [(0.7, 100), (0.8, 100)],
            ("real_rgbd", "seen", "dgcnn-none"): [(0.9, 60), (0.8, 20)],
            ("real_rgbd", "unseen", "dgcnn-none"): [(0.4, 40), (0.8, 80)],
            ("real_rgbd", "dataset/lmo", "dgcnn-none"): [(0.6, 30)],
            ("real_rgbd_estimated", "attribution", "gpca_pair"): [(0.5, 100), (0.7, 100)],
        }
    )
    assert [tuple(key for key, _ in row) for row in table.rows] == [
        ("real_rgbd", "dgcnn-none"), ("real_rgbd_estimated", "gpca_pair"),
    ]  # fmt: skip
    assert table.cells[0, "seen"].mean == pytest.approx(87.5)  # of 60 and 20 samples
    assert table.cells[0, "unseen"].mean == pytest.approx(80 * 8 / 12 + 40 * 4 / 12)
    assert table.cells[0, "dataset/lmo"].mean == pytest.approx(60)
    assert table.cells[1, "attribution"].mean == pytest.approx(60)
    assert (1, "seen") not in table.cells
    assert table.cells[0, "nll"].mean == 1.5
    text = table.markdown()
    assert "40 % of the test samples" in text
    assert "| LINEMOD-Occlusion (%) |" in text
    counts = "Test samples, True pose: All 200 (2 seeds), Seen objects 80 (2 seeds), Unseen objects 120 (2 seeds)"
    assert f"{counts}, LINEMOD-Occlusion 30 (1 seed)." in text
    assert "Test samples, Pose estimators: All 200 (2 seeds)." in text


def test_the_note_says_that_the_pretraining_knows_the_models():
    values = {("real_rgbd", "attribution", "dgcnn-none"): [(0.7, 100)]}
    assert "renders the models" not in " ".join(make(values).footnotes)
    assert "The pretraining renders the models of both." in " ".join(make(values, rendered=True).footnotes)


def test_nothing_to_show_is_refused():
    with pytest.raises(InputError, match="has nothing to show"):
        make({("real_rgbd", "attribution", "other"): [(0.7, 100)]})
