import pytest

from gpca.active_learning.curves import POOL_COLUMNS, write_curves
from gpca.errors import InputError
from gpca.experiments.active_learning.figure import draw_overlap_curves, mean_curves
from gpca.experiments.new_concepts.figure import draw_new_concepts
from tests.figures import words_of


def curve(rounds, best):
    return [
        {"labels": 4 * n, "new_labels": n, "accuracy": 0.5 + best * n / rounds, "accuracy_new": 0.5, "epochs": 1}
        for n in range(rounds + 1)
    ]


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / "ycb" / strategy / "seed0.csv" for strategy in ("bald_kmeans", "random")]
    for path in paths:
        path.parent.mkdir(parents=True)
        curves = {
            ("pretrained", "overlap"): curve(3, 0.4),
            ("pretrained", "noise"): curve(3, 0.2),
            ("rare_5", "overlap"): curve(6, 0.3),
            ("pair", "overlap"): curve(3, 0.5),
            ("pair_errors_10", "overlap"): curve(3, 0.1),
            ("pair", "nominal"): curve(3, 0.2),
        }
        write_curves(path, curves, POOL_COLUMNS)
    return paths


def test_the_mean_is_over_the_concepts_asked_for(files):
    key = ("ycb", "random", "pretrained")
    assert mean_curves(files)[key]["mean"].tolist()[-1] == pytest.approx(80)
    assert mean_curves(files, ["overlap"])[key]["mean"].tolist()[-1] == pytest.approx(90)


def test_the_papers_experiment_has_the_rare_pool_below(files):
    titles = {"bald_kmeans": "BALD + k-means", "random": "Random"}
    words = words_of(draw_overlap_curves(files, {"ycb": "YCB"}, titles, 0.9))
    assert {"YCB", "BALD + k-means", "Random"} <= set(words)
    assert sum("5 % of the pool" in text for text in words) == 1
    assert not [text for text in words if "never saw" in text]


def test_a_line_is_drawn_for_each_embedding_and_a_row_for_each_kind_of_concept(files):
    words = words_of(draw_new_concepts(files, {"ycb": "YCB"}, 0.9))
    assert [text for text in words if text in ("same samples, all concepts", "nothing: measurements of the pair")]
    assert not [text for text in words if "errors" in text]
    rows = [text for text in words if "new: " in text]
    assert len(rows) == 2
    assert any("nominal" in text for text in rows)
    assert {"Means over 1 seed", "target (90 %)"} <= set(words)


def test_without_a_curve_nothing_is_drawn(files):
    with pytest.raises(InputError, match="has no curve of these sources"):
        draw_new_concepts(files, {"cups": "Cups"}, 0.9)
