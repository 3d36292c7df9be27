import numpy as np
import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.errors import InputError
from gpca.experiments.active_learning.figure import MOST_LINES, STYLES, draw_learning_curves, mean_curves
from gpca.reporting.figures.cloud_views import draw_query

TITLES = {"random": "Random", "bald_kmeans": "BALD + k-means", "mine": "Mine"}
SOURCES = {"ycb": "YCB (procedural stand-in)", "linemod": "LINEMOD"}


@pytest.fixture
def files(tmp_path):
    paths = []
    for source in SOURCES:
        for strategy in TITLES:
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


def test_curves_are_means_over_concepts_and_intervals_over_seeds(files):
    curve = mean_curves(files)["ycb", "random", "pretrained"]
    assert curve["labels"].tolist() == [0, 4, 8, 12]
    assert curve["mean"].tolist() == pytest.approx([56, 66, 76, 86])
    # Two seeds 2 points apart: s = √2, t_1 = 12.706.
    assert (curve["high"] - curve["mean"]).tolist() == pytest.approx([12.706] * 4, abs=1e-3)
    assert curve["seeds"].tolist() == [2] * 4


def test_labels_that_not_every_seed_was_looked_at_are_left_out(files):
    key = ("ycb", "random", "pretrained")
    [path] = [file for file in files if file.parts[-3:] == ("ycb", "random", "seed1.csv")]
    step = {"new_labels": 1, "accuracy": 0.9, "accuracy_new": 0.9, "epochs": 1}
    steps = [{"labels": labels, **step} for labels in (0, 3, 4, 8)]
    write_curves(path, {("pretrained", "noise"): steps}, POOL_COLUMNS)
    assert mean_curves(files)[key]["labels"].tolist() == [0, 4, 8]


def test_the_target_is_named_and_the_seeds_are_counted(files):
    figure = draw_learning_curves(files, SOURCES, TITLES, 0.9)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [*TITLES.values(), "target (90 %)"]
    assert [text.get_text() for text in figure.texts] == ["Means over 2 seeds"]


def test_no_two_strategies_look_alike():
    looks = [(color, line) for color, line, _ in STYLES.values()]
    assert len(set(looks)) == len(looks)


def test_the_figure_is_the_same_bytes_each_time(files, same_bytes):
    same_bytes(lambda: draw_learning_curves(files, SOURCES, TITLES, 0.9))


def test_without_a_curve_of_these_sources_nothing_is_drawn(files):
    with pytest.raises(InputError, match="has no curve of these sources and strategies"):
        draw_learning_curves(files, {"cups": "Cups"}, TITLES, 0.9)


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
    figure = draw_learning_curves(paths, {"ycb": "YCB"}, {name: name for name in names}, 0.9)
    drawn = [{line.get_label() for line in panel.get_lines()} - {"target (90 %)"} for panel in figure.axes]
    assert max(map(len, drawn)) <= MOST_LINES
    assert all({"bald_kmeans", "random"} < lines for lines in drawn)
    assert set().union(*drawn) == set(names)
