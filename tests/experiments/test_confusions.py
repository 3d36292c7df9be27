import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments import confusions as confusions_figure
from gpca.experiments.confusions import draw_confusions_figure, letters, pooled_confusions

CONCEPTS = ("noise", "pose", "overlap")
SOURCES = {"cup": "Coffee Cup (procedural stand-in)", "ycb": "YCB (procedural stand-in)"}
EXPLAINERS = {f"explainer_{i}": f"Explainer {i} with a title that is long (oracle)" for i in range(5)}
COUNTS = np.array([[8, 1, 0, 1], [3, 5, 2, 0], [0, 0, 10, 0]])  # last: abstained


def records(source, explainer, counts, seed=0):
    return [
        ("attribution", source, explainer, f"predicted_as_{predicted}", true, seed, float(counts[row][column]))
        for column, predicted in enumerate((*CONCEPTS, "abstained"))
        for row, true in enumerate(CONCEPTS)
    ]


def tidy(rows):
    return pd.DataFrame(rows, columns=list(TIDY_COLUMNS))


@pytest.fixture
def metrics():
    """All explainers on both sources, two seeds; the last one only on one."""
    random = np.random.default_rng(0)
    rows = []
    for source in SOURCES:
        for explainer in EXPLAINERS:
            if (source, explainer) != ("cup", "explainer_4"):
                rows += [r for seed in (0, 1) for r in records(source, explainer, random.integers(0, 9, (3, 4)), seed)]
    return tidy(rows)


def test_confusions_are_pooled_over_seeds_in_the_order_of_the_concepts():
    metrics = tidy([*records("ycb", "shap", COUNTS, 0), *records("ycb", "shap", COUNTS, 1)])
    accuracies = tidy([("attribution", "ycb", "shap", "accuracy", "all", 0, 0.5)])
    pooled = pooled_confusions(pd.concat([accuracies, metrics]))
    assert list(pooled) == [("ycb", "shap")]
    confusion = pooled["ycb", "shap"]
    assert list(confusion.index) == list(CONCEPTS)
    assert list(confusion.columns) == [*CONCEPTS, "abstained"]
    np.testing.assert_array_equal(confusion, 2 * COUNTS)


def axes_of(draw, *arguments):
    confusions_figure.use_style()
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots()
    draw(axes, *arguments)
    plt.close(figure)
    return axes


def test_a_matrix_shows_the_share_of_each_true_concept_and_bars_those_of_all():
    confusion = pooled_confusions(tidy(records("ycb", "shap", COUNTS)))["ycb", "shap"]
    shown = [text.get_text() for text in axes_of(confusions_figure.draw_matrix, confusion, True).texts]
    assert shown == ["80", "10", "0", "30", "50", "20", "0", "0", "100"]
    without_overlap = axes_of(confusions_figure.draw_matrix, confusion.loc[["noise", "pose"]], True)
    assert [text.get_text() for text in without_overlap.texts] == shown[:6]
    axes = axes_of(confusions_figure.draw_bars, confusion, True)
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([11 / 30, 6 / 30, 12 / 30, 1 / 30])
    [dashes] = axes.collections
    assert [segment[0][1] for segment in dashes.get_segments()] == pytest.approx([1 / 3] * 3)
    assert [label.get_text() for label in axes.get_xticklabels()] == ["N", "P", "O", "–"]


def test_where_none_abstains_there_is_no_bar_and_no_word_for_it():
    rows = records("ycb", "explainer_0", COUNTS * [1, 1, 1, 0])
    rows_of_others = records("cup", "other", COUNTS)
    for part in (rows, rows + rows_of_others):
        figure = draw_confusions_figure(tidy(part), SOURCES, EXPLAINERS)
        assert [label.get_text() for label in figure.axes[1].get_xticklabels()] == ["N", "P", "O"]
        assert not [text for text in figure.texts if "abstained" in text.get_text()]


def test_letters_tell_concepts_apart_and_nominal_is_ok():
    assert letters(["noise", "pose", "overlap"]) == ["N", "P", "O"]
    assert letters(["pose", "position", "noise"]) == ["Pose", "Posi", "Nois"]
    assert letters(["nominal", "noise", "pose", "overlap"]) == ["OK", "N", "P", "O"]


def test_the_same_metrics_give_the_same_bytes(metrics, same_bytes):
    same_bytes(lambda: draw_confusions_figure(metrics, SOURCES, EXPLAINERS))


def test_nothing_overlaps_and_all_stays_on_the_page(metrics):
    figure = draw_confusions_figure(metrics, SOURCES, EXPLAINERS)
    assert len(figure.axes) == 2 * (2 * 5 - 1)
    renderer = figure.canvas.get_renderer()
    words = " ".join(text.get_text().replace("\n", " ") for text in figure.texts)
    for title in (*SOURCES.values(), *EXPLAINERS.values()):
        assert title in words
    texts = [text.get_window_extent(renderer) for text in figure.texts]
    panels = [axes.get_tightbbox(renderer) for axes in figure.axes]
    for box in (*texts, *panels):
        assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 and box.y1 <= figure.bbox.y1
    boxes = [*texts, *panels]
    for number, first in enumerate(boxes):
        assert not [box for box in boxes[number + 1 :] if first.overlaps(box)]


def test_metrics_without_these_confusions_are_refused(metrics):
    with pytest.raises(InputError, match="are of none of these explainers and sources"):
        draw_confusions_figure(metrics, SOURCES, {"other": "Other"})
