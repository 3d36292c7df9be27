import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, COLUMNS, TIDY_COLUMNS
from gpca.experiments import frame_tables

PARAMETERS = {"dgcnn": 600_000, "pointnet": 150_000, "dgcnn_1024": 750_000, "mine": 1000}
CONFIG = {
    **{"title": "Frames", "datasets": None, "initial_pose": {"form": "true_pose"}, "pretraining": {}, "virtual": None},
    **{"conditions": {"estimated": {"form": "ppf"}}, "backbones": ["dgcnn", "pointnet"], "reductions": ["none", "pca"]},
    **{"published": {}, "explainers": {}},
}


@pytest.fixture(autouse=True)
def _known_numbers_of_parameters(monkeypatch):
    monkeypatch.setattr(frame_tables, "make_encoder", lambda backbone, options: backbone)
    monkeypatch.setattr(frame_tables, "parameter_count", PARAMETERS.get)


def run(**changes):
    encoders = {name: {"backbone": name} for name in PARAMETERS}
    return Run({"real_world": CONFIG | changes, "encoders": encoders, "data_dir": None})


def metrics(values, seeds=3):
    """Metrics of method -> accuracies by seed."""
    rows = []
    for method, accuracies in values.items():
        for seed, accuracy in enumerate(accuracies[:seeds]):
            rows.append(("attribution", "real_rgbd", method, "accuracy", ALL, seed, accuracy))
            rows.append(("attribution", "real_rgbd", method, "test_samples", ALL, seed, 300))
    return pd.DataFrame(rows, columns=list(TIDY_COLUMNS))


def intervals(values, seeds=3):
    """Of the same methods; a concept's accuracies are half a point above, and the first is compared with none."""
    rows = []
    for method, accuracies in values.items():
        mean = sum(accuracies[:seeds]) / len(accuracies[:seeds])
        told = {("accuracy", ALL): mean, ("accuracy", "pose"): mean + 0.005}
        if method != "dgcnn-none":
            told["difference", ALL] = mean - sum(values.get("dgcnn-none", (0.8,))[:seeds]) / seeds
        for (metric, concept), value in told.items():
            own = ("attribution", "real_rgbd", method, metric, concept, len(accuracies[:seeds]), 12, 300 * seeds)
            rows.append((*own, value, value - 0.04, value + 0.02))
    return pd.DataFrame(rows, columns=list(COLUMNS))


VALUES = {
    "dgcnn-none": (0.80, 0.84, 0.82),
    "dgcnn-pca": (0.81, 0.85, 0.83),
    "pointnet-none": (0.60, 0.70, 0.65),
    "analytical_gpc": (0.7, 0.7, 0.7),
}


def make(values=VALUES, seeds=3, **changes):
    return frame_tables.table6_backbones(run(**changes), intervals(values, seeds), metrics(values, seeds))


def test_rows_are_backbones_by_reductions_that_were_run_and_one_seed_has_no_deviation():
    labels = [tuple(key for key, _ in row) for row in make().rows]
    assert labels == [("dgcnn", "none"), ("dgcnn", "pca"), ("pointnet", "none"), ("analytical_gpc", "none")]
    table = make(seeds=1)
    assert (0, "deviation") not in table.cells
    assert "| 82.0 (78.0 to 84.0) |" in make({"dgcnn-none": (0.82,)}, seeds=1).markdown()
    assert "Over 1 seed, 300 test samples each" in table.markdown()
    assert len(make({"dgcnn-none": (0.8, 0.8)}).rows) == 1
    with pytest.raises(InputError, match="has nothing to show"):
        make({"softmax_head": (0.8, 0.8)})


def test_accuracies_and_differences_have_their_interval_over_scenes_and_the_deviation_is_of_the_seeds():
    table = make()
    cells = table.cells
    assert cells[0, "accuracy"].mean == pytest.approx(82) and cells[0, "accuracy"].bounds == pytest.approx((78, 84))
    assert cells[0, "deviation"].mean == pytest.approx(2)
    assert (0, "difference") not in cells
    assert cells[1, "difference"].mean == pytest.approx(1.0)
    assert cells[2, "difference"].bounds == pytest.approx((-21, -15))
    assert cells[2, "pose"].mean == pytest.approx(65.5)
    assert cells[2, "parameters"].mean == 150
    assert (3, "parameters") not in cells
    assert table.best() == {(1, "accuracy")}
    note = "Over 3 seeds, 300 test samples each; in brackets: the 95 % interval of a bootstrap over scenes"
    assert note in table.footnotes[0]


def test_untrained_explainers_and_published_encoders_stand_below_and_are_never_the_best():
    values = VALUES | {"chance": (0.3, 0.3, 0.4), "gpca_pair": (0.9, 0.9, 0.9)}
    table = make(values, explainers={"chance": {}, "gpca_pair": {}})
    assert [row[0][0] for row in table.rows][-2:] == ["analytical_gpc", "chance"]
    assert table.best() == make().best()
    values = {"mine-none": (0.8, 0.8, 0.8), "pointnet-none": (0.6, 0.7, 0.65)}
    assert "| To mine (points) |" in make(values, backbones=["mine", "pointnet"], reductions=["none"]).markdown()
    values = VALUES | {"dgcnn_1024-none": (0.9, 0.9, 0.9), "dgcnn_1024-pca": (0.9, 0.9, 0.8)}
    published = {"published": {"dgcnn": "dgcnn_1024"}}
    table = make(values, **published)
    assert [tuple(key for key, _ in row) for row in table.rows][2:] == [
        ("pointnet", "none"), ("dgcnn_1024", "none"), ("dgcnn_1024", "pca"), ("analytical_gpc", "none"),
    ]  # fmt: skip
    assert table.cells[3, "parameters"].mean == 750 and table.best() == make().best()
    assert "DGCNN of 1024 features: readings of which architecture" in " ".join(table.footnotes)
    assert "readings of" not in " ".join(make(values).footnotes)


def seen(values):
    """Intervals and metrics of (source, table, method) -> accuracy, samples and seeds."""
    rows, scores = [], []
    for (source, table, method), (accuracy, samples, seeds) in values.items():
        own = (table, source, method, "accuracy", ALL, seeds, 9, samples)
        rows.append((*own, accuracy, accuracy - 0.04, accuracy + 0.02))
        scores += [
            (table, source, method, metric, ALL, seed, value)
            for seed in range(seeds)
            for metric, value in {"ece": 0.1, "nll": 1.5, "test_samples": samples / seeds}.items()
        ]
    return pd.DataFrame(rows, columns=list(COLUMNS)), pd.DataFrame(scores, columns=list(TIDY_COLUMNS))


def make_seen(values, **changes):
    changes = {"backbones": ["dgcnn"], "reductions": ["none"], "explainers": {"gpca_pair": {}}} | changes
    return frame_tables.table6_seen_unseen(run(**changes), *seen(values))


def test_rows_are_conditions_by_methods_and_columns_what_was_seen():
    table = make_seen(
        {
            ("real_rgbd", "attribution", "dgcnn-none"): (0.75, 200, 2),
            ("real_rgbd", "seen", "dgcnn-none"): (0.875, 80, 2),
            ("real_rgbd", "unseen", "dgcnn-none"): (0.6, 120, 2),
            ("real_rgbd", "dataset/lmo", "dgcnn-none"): (0.6, 30, 1),
            ("real_rgbd_estimated", "attribution", "gpca_pair"): (0.6, 200, 2),
        }
    )
    assert [tuple(key for key, _ in row) for row in table.rows] == [
        ("real_rgbd", "dgcnn-none", "aligned source"), ("real_rgbd_estimated", "gpca_pair", "pair + motion"),
    ]  # fmt: skip
    assert table.cells[0, "seen"].mean == pytest.approx(87.5)
    assert table.cells[0, "unseen"].bounds == pytest.approx((56, 62))
    assert table.cells[0, "dataset/lmo"].mean == pytest.approx(60)
    assert table.cells[1, "attribution"].mean == pytest.approx(60)
    assert (1, "seen") not in table.cells
    assert table.cells[0, "nll"].mean == 1.5
    text = table.markdown()
    assert "40 % of the test samples" in text
    assert "| LINEMOD-Occlusion (%) |" in text


def test_the_note_says_that_the_pretraining_knows_the_models():
    values = {("real_rgbd", "attribution", "dgcnn-none"): (0.7, 100, 1)}
    assert "renders the models" not in " ".join(make_seen(values).footnotes)
    notes = make_seen(values, virtual={"objects": "all"}).footnotes
    assert "The pretraining renders the models of both." in " ".join(notes)
    with pytest.raises(InputError, match="has nothing to show"):
        make_seen({("real_rgbd", "attribution", "other"): (0.7, 100, 1)})
