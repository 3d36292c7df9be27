"""Tables and learning curves of active learning, and how many families their test samples come from."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.active_learning import (
    active_learning_curves,
    active_learning_overlap,
    table3_active_learning,
    table3_extended,
    titles,
)
from gpca.experiments.label_curves import MOST_LINES, STYLES, families, mean_curves
from gpca.reporting.figures.cloud_views import draw_query
from tests.figures import words_of

REAL = {"linemod": {"title": "LINEMOD", "stand_in": False}, "ycb": {"title": "YCB", "stand_in": False}}
STAND_INS = {name: entry | {"stand_in": True} for name, entry in REAL.items()}
STRATEGIES = ["random", "random_stratified", "bald_kmeans", "stream_bald"]
LEARNING = {
    "strategies": STRATEGIES, "initial": 120, "labels": 60, "batch": 4, "target": 0.9, "iterations": 100,
    "stream": {"arrivals": 400, "quiet": 100, "budget": 0.1},
    "rare": {
        "shares": [0.05, 0.01], "labels": 550, "least": 60, "batch": 4, "late_batch": 10,
        "gpc": {"kernel": "rbf", "learning_rate": 0.01, "iterations": 100},
    },
}  # fmt: skip
FAMILIES = {("ycb", seed): 11 for seed in range(3)}


def made(table, metrics, clusters=FAMILIES, sources=REAL, **learning):
    """A table of a run with these sources and settings of active learning."""
    registrations = {"train": 800, "test": 200}
    run = Run({"sources": sources, "active_learning": LEARNING | learning, "registrations": registrations})
    return table(run, metrics, clusters)


def wilson(percent):
    """The bounds of a share of all families of three seeds."""
    low, high = (100 * bound for bound in wilson_interval(percent / 100 * 33, 33))
    return f"{low:.1f} to {high:.1f}"


AT_96 = f"96.0 ({wilson(96)})"


def tidy(values):
    """Metrics from {(setting, source, strategy, concept, metric): values over seeds}."""
    return pd.DataFrame(
        [
            (f"active_learning/{setting}", source, strategy, metric, concept, seed, value)
            for (setting, source, strategy, concept, metric), of_seeds in values.items()
            for seed, value in enumerate(of_seeds)
        ],
        columns=list(TIDY_COLUMNS),
    )


@pytest.fixture
def metrics():
    of_ycb = ("pretrained", "ycb")
    return tidy(
        {
            (*of_ycb, "bald_kmeans", "overlap", "labels_to_target"): [12, 16, 20],
            (*of_ycb, "bald_kmeans", "overlap", "reached"): [1, 1, 1],
            (*of_ycb, "bald_kmeans", "overlap", "final_accuracy"): [0.95, 0.96, 0.97],
            (*of_ycb, "bald_kmeans", "overlap", "area_under_curve"): [0.8, 0.8, 0.8],
            (*of_ycb, "bald_kmeans", "pose", "area_under_curve"): [0.6, 0.6, 0.6],
            (*of_ycb, "bald_kmeans", "overlap", "area_gain"): [-0.1, 0.0, 0.1],
            (*of_ycb, "bald_kmeans", "noise", "labels_to_target"): [2, 2, 2],
            (*of_ycb, "random", "overlap", "labels_to_target"): [40, 60, 44],
            (*of_ycb, "random", "overlap", "reached"): [1, 0, 1],
            (*of_ycb, "random", "overlap", "area_under_curve"): [0.75, 0.75, 0.75],
            (*of_ycb, "random_stratified", "overlap", "area_under_curve"): [0.9, 0.9, 0.9],
            (*of_ycb, "stream_bald", "overlap", "delay"): [60, 70, 50],
            (*of_ycb, "stream_bald", "overlap", "recognised"): [1, 1, 1],
            (*of_ycb, "stream_bald", "overlap", "final_accuracy"): [0.9, 0.9, 0.9],
            ("unseen", "ycb", "random", "overlap", "labels_to_target"): [60, 60, 60],
            ("unseen", "ycb", "random", "overlap", "reached"): [0, 0, 0],
            ("rare_5", "ycb", "bald_kmeans", "overlap", "labels_to_target"): [10, 11, 12],
            ("rare_5", "ycb", "bald_kmeans", "overlap", "epochs_at_target"): [60, 70, 80],
            ("rare_5", "ycb", "bald", "overlap", "labels_to_target"): [14, 16, 18],
            ("rare_5", "ycb", "random", "overlap", "labels_to_target"): [200, 250, 300],
            ("rare_1", "ycb", "random", "overlap", "labels_to_target"): [400, 400, 400],
        }
    )


def test_table3_shows_the_papers_experiment_alone_its_conditions_and_lower_bounds(metrics):
    markdown = made(table3_active_learning, metrics).markdown()
    assert "| Dataset | Encoder saw | Labels, BALD + k-means | Labels, BALD | Labels, random |" in markdown
    rows = [line for line in markdown.splitlines() if line.startswith("| YCB")]
    assert rows[0].startswith("| YCB | all concepts; 5 % of the pool new | **11 ± 2** | 16 ± 5 | 250 ± 124 |")
    assert rows[0].endswith("| 70 ± 25 |")
    assert rows[1].startswith("| YCB | all concepts; 1 % of the pool new | – | – | 400 ± 0 |")
    # Two of three random runs reached the target: their mean is a lower bound, without an interval, and never bold.
    assert f"| YCB | all concepts | **16 ± 10** | – | > 48 | {AT_96} |" in markdown
    assert "| YCB | the known concepts only | – | – | > 60 |" in markdown
    assert "LINEMOD" not in markdown
    judged = ("(rbf, rate 0.01, 100 passes)", "labels, of 10 from 60 on, at most 550.")
    for words in ("120 labeled samples", "680 training samples", "4 labels a round, 60 in all", *judged):
        assert words in markdown
    assert "Mean over 3 seeds, 200 test samples each" in markdown
    records = made(table3_active_learning, metrics).records()
    assert ("ycb", "pretrained", "labels_random", 48.0, "", "", 3, 600, True) in records
    assert ("ycb", "pretrained", "labels_bald_kmeans", 16.0, 6.063449, 25.936551, 3, 600, False) in records


def test_extended_averages_over_the_concepts_held_out_and_leaves_the_oracle_out_of_the_comparison(metrics):
    markdown = made(table3_extended, metrics).markdown()
    assert "Labels, overlap" in markdown
    [bald] = [line for line in markdown.splitlines() if "BALD + k-means" in line and "YCB" in line]
    assert f"70.0 ({wilson(70)})" in bald  # all seeds agree
    assert "**0.0 ± 24.8**" not in bald
    [oracle] = [line for line in markdown.splitlines() if "Stratified random" in line]
    assert "**" not in oracle
    assert f"**75.0 ({wilson(75)})**" in markdown
    assert "tream" not in markdown.split("Mean over")[0]


def test_the_families_of_test_samples_alone_are_counted_and_a_file_of_another_seed_is_refused(registrations, tmp_path):
    (tmp_path / "tiny").mkdir()
    in_test = registrations.split == "test"
    family_S = np.where(in_test, np.where(registrations.cluster == "brick", "box", "round"), "other")
    of_seed = dataclasses.replace(registrations, cluster=family_S, axes=("tiny", 0))
    for seed in (0, 1):
        of_seed.save(tmp_path / f"tiny/seed{seed}.npz")
    assert families([tmp_path / "tiny/seed0.npz"]) == {("tiny", 0): 2}
    with pytest.raises(InputError, match="seed"):
        families([tmp_path / "tiny/seed1.npz"])


CURVES = ("random", "bald_kmeans", "margin")
SOURCES = {"ycb": STAND_INS["ycb"], "linemod": REAL["linemod"]}


def drawn(files, sources=None, strategies=CURVES, figure=active_learning_curves):
    learning = {"strategies": list(strategies), "target": 0.9}
    return figure(Run({"sources": sources or SOURCES, "active_learning": learning}), files)


@pytest.fixture
def curve_files(tmp_path):
    paths = []
    for source in SOURCES:
        for strategy in CURVES:
            for seed in range(2):
                curves = {
                    (setting, held_out): [
                        {
                            "labels": 4 * n,
                            "new_labels": n,
                            "accuracy": 0.5 + 0.1 * n + 0.02 * seed + bonus,
                            "accuracy_new": 0.5,
                            "epochs": 1,
                        }
                        for n in range(4)
                    ]
                    for setting in ("pretrained", "unseen")
                    for held_out, bonus in (("noise", 0.0), ("pose", 0.1))
                }
                path = tmp_path / source / strategy / f"seed{seed}.csv"
                path.parent.mkdir(parents=True, exist_ok=True)
                write_curves(path, curves, POOL_COLUMNS)
                paths.append(path)
    return paths


def test_curves_are_means_over_concepts_with_intervals_over_the_seeds_that_all_have_the_labels(curve_files):
    curve = mean_curves(curve_files)["ycb", "random", "pretrained"]
    assert curve["labels"].tolist() == [0, 4, 8, 12]
    assert curve["mean"].tolist() == pytest.approx([56, 66, 76, 86])
    # Two seeds 2 points apart: s = √2, t_1 = 12.706.
    assert (curve["high"] - curve["mean"]).tolist() == pytest.approx([12.706] * 4, abs=1e-3)
    assert curve["seeds"].tolist() == [2] * 4
    key = ("ycb", "random", "pretrained")
    [path] = [file for file in curve_files if file.parts[-3:] == ("ycb", "random", "seed1.csv")]
    step = {"new_labels": 1, "accuracy": 0.9, "accuracy_new": 0.9, "epochs": 1}
    steps = [{"labels": labels, **step} for labels in (0, 3, 4, 8)]
    write_curves(path, {("pretrained", "noise"): steps}, POOL_COLUMNS)
    assert mean_curves(curve_files)[key]["labels"].tolist() == [0, 4, 8]


def test_the_target_is_named_the_seeds_are_counted_and_other_sources_draw_nothing(curve_files):
    figure = drawn(curve_files)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [*titles(CURVES).values(), "target (90 %)"]
    assert [text.get_text() for text in figure.texts] == ["Means over 2 seeds"]
    with pytest.raises(InputError, match="has no curve of these sources and strategies"):
        drawn(curve_files, {"cups": REAL["ycb"]})


def test_a_query_is_drawn_with_few_or_many_points(tmp_path):
    random = np.random.default_rng(0)
    for points in (3, 5000):
        draw_query(
            random.normal(size=(points, 3)), random.normal(size=(points, 3)), "train sample 1: cup", tmp_path / "q.png"
        )
        assert (tmp_path / "q.png").read_bytes()[:4] == b"\x89PNG"


def test_a_panel_has_at_most_six_lines_and_the_papers_strategies_are_in_each(tmp_path):
    names = list(STYLES)
    paths = []
    for strategy in names:
        path = tmp_path / "ycb" / strategy / "seed0.csv"
        path.parent.mkdir(parents=True)
        steps = [{"labels": n, "new_labels": n, "accuracy": 0.5, "accuracy_new": 0.5, "epochs": 1} for n in range(2)]
        write_curves(path, {("pretrained", "noise"): steps}, POOL_COLUMNS)
        paths.append(path)
    figure = drawn(paths, {"ycb": REAL["ycb"]}, names)
    lines_of = [{line.get_label() for line in panel.get_lines()} - {"target (90 %)"} for panel in figure.axes]
    assert max(map(len, lines_of)) <= MOST_LINES
    assert all(set(titles(["bald_kmeans", "random"]).values()) < lines for lines in lines_of)
    assert set().union(*lines_of) == set(titles(names).values())


def test_the_papers_experiment_is_one_concept_with_the_rare_pool_below(rare_files):
    key = ("ycb", "random", "pretrained")
    assert mean_curves(rare_files)[key]["mean"].tolist()[-1] == pytest.approx(80)
    assert mean_curves(rare_files, ["overlap"])[key]["mean"].tolist()[-1] == pytest.approx(90)
    strategies = ("bald_kmeans", "random")
    words = words_of(drawn(rare_files, {"ycb": REAL["ycb"]}, strategies, active_learning_overlap))
    assert {"YCB", *titles(strategies).values()} <= set(words)
    assert sum("5 % of the pool" in text for text in words) == 1
    assert not [text for text in words if "never saw" in text]
