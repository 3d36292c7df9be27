import numpy as np
import pandas as pd

from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.confusions import MOST, draw_confusions, pooled_confusions

CONCEPTS = ("noise", "pose", "overlap")
EXPLAINERS = {f"explainer_{i}": f"Explainer {i} with a title that is long (oracle)" for i in range(6)}
COUNTS = np.array([[8, 1, 0, 1], [3, 5, 2, 0], [0, 0, 10, 0]])  # last: abstained


def records(source, explainer, counts, seed=0):
    return [
        ("attribution", source, explainer, f"predicted_as_{predicted}", true, seed, float(counts[row][column]))
        for column, predicted in enumerate((*CONCEPTS, "abstained"))
        for row, true in enumerate(CONCEPTS)
    ]


def tidy(rows):
    return pd.DataFrame(rows, columns=list(TIDY_COLUMNS))


def test_confusions_are_pooled_in_the_order_of_the_concepts_and_shown_as_shares():
    metrics = tidy([*records("ycb", "shap", COUNTS, 0), *records("cup", "shap", COUNTS, 1)])
    accuracies = tidy([("attribution", "ycb", "shap", "accuracy", "all", 0, 0.5)])
    pooled = pooled_confusions(pd.concat([accuracies, metrics]))
    assert list(pooled) == ["shap"]
    assert list(pooled["shap"].index) == list(CONCEPTS)
    assert list(pooled["shap"].columns) == [*CONCEPTS, "abstained"]
    np.testing.assert_array_equal(pooled["shap"], 2 * COUNTS)
    figure = draw_confusions(tidy(records("ycb", "explainer_0", COUNTS)), EXPLAINERS, (), "YCB")
    [panel] = figure.axes
    shown = ["80 %", "10 %", "0 %", "30 %", "50 %", "20 %", "0 %", "0 %", "100 %"]
    assert [text.get_text() for text in panel.texts] == shown


def test_the_first_named_are_drawn_first_and_no_more_than_fit():
    # All explainers on two sources and two seeds.
    random = np.random.default_rng(0)
    axes = [(source, name, seed) for source in ("cup", "ycb") for name in EXPLAINERS for seed in (0, 1)]
    metrics = tidy([row for s, name, seed in axes for row in records(s, name, random.integers(0, 9, (3, 4)), seed)])
    figure = draw_confusions(metrics, EXPLAINERS, ("explainer_5", "absent", "explainer_2"), "both")
    shown = [panel.get_title().replace("\n", " ") for panel in figure.axes]
    assert len(shown) == MOST
    assert [title.split()[1] for title in shown] == ["5", "2", "0", "1"]
