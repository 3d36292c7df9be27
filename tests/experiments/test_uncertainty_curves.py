import pandas as pd
import pytest

from gpca.attribution.learner_predictions import sets_of
from gpca.errors import InputError
from gpca.experiments import uncertainty_curves
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import write_csv
from gpca.pairs.shifted_sets import DISTANCES
from gpca.reporting.figures import style
from gpca.steps.shift import predict_sets

from ..pairs.test_shifted_sets import sets
from ..steps.test_shift import quick
from .runs import run_with

SOURCES = {"cups": {"title": "Cups", "kind": "procedural"}, "parts": {"title": "Parts", "kind": "bop"}}
MAKE = {
    "gpca": quick,
    "learner_nearest": lambda: explainer_entry("learner_nearest").make("tiny", 0),
    "learner_logistic": lambda: explainer_entry("learner_logistic").make("tiny", 0),
}
LEARNERS = dict.fromkeys([*MAKE, "learner_forest"])  # the last one has no predictions
RUN = run_with(sources=SOURCES, learners=LEARNERS)
DRAW = [uncertainty_curves.coverage_risk, uncertainty_curves.reliability, uncertainty_curves.uncertainty_vs_distance]


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("learned")
    predictions, set_files = [], []
    for source in SOURCES:
        path = folder / "shifted" / source / "seed0.npz"
        path.parent.mkdir(parents=True)
        sets().save(path, ("tiny", 0))
        set_files.append(path)
        for name, make in MAKE.items():
            predictions.append(folder / "learners" / source / name / "seed0.csv")
            write_csv(predictions[-1], predict_sets(make, sets()))
    return uncertainty_curves.read_with_distances([*predictions, *set_files])


@pytest.mark.parametrize("draw", DRAW)
def test_a_figure_is_the_same_bytes_each_time(learned, draw, same_bytes):
    same_bytes(lambda: draw(RUN, learned))


@pytest.mark.parametrize("draw", DRAW)
def test_without_predictions_nothing_is_drawn(learned, draw):
    without = {"sources": {"mugs": SOURCES["cups"]}}, {"learners": {"learner_forest": None}}
    for sections in without:
        with pytest.raises(InputError, match="have no predictions of these sources and learners"):
            draw(run_with(**{"sources": SOURCES, "learners": LEARNERS} | sections), learned)


def test_a_panel_says_of_how_many_samples_it_is_and_lines_have_bands(learned):
    figure = uncertainty_curves.uncertainty_vs_distance(RUN, learned)
    names = ("in_distribution", "in_distribution+severity", "seen_objects+objects")  # There is no other source.
    assert len(figure.axes) == len(names) * len(SOURCES)
    for row, name in enumerate(names):
        for column, source in enumerate(SOURCES):
            panel = figure.axes[2 * row + column]
            samples = len(sets_of(learned[source, "gpca", 0])[name])
            assert [text.get_text() for text in panel.texts] == [f"$n$ = {samples}"], (name, source)
            assert len(panel.get_lines()) == len(panel.collections) == 1
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["GP-CA (trained longer)"]


def test_classifiers_with_a_look_of_their_own_are_drawn_alone(learned):
    figure = uncertainty_curves.coverage_risk(RUN, learned)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["GP-CA (trained longer)"]
    assert [line.get_color() for line in figure.axes[0].get_lines()] == [style.BLUE]
    others = {key: rows for key, rows in learned.items() if key[1] != "gpca"}
    named = [text.get_text() for text in uncertainty_curves.coverage_risk(RUN, others).legends[0].get_texts()]
    assert named == ["k nearest embeddings", "Logistic regression"]


def test_curves_of_risk_start_at_zero_and_a_panel_without_errors_says_so(learned):
    wrong = {
        key: rows.assign(concept_predicted=rows["concept_true"] if key[0] == "cups" else "none", abstained=False)
        for key, rows in learned.items()
    }
    cups, parts = uncertainty_curves.coverage_risk(RUN, wrong).axes[:2]
    assert [text.get_text() for text in cups.texts] == ["no errors"]
    assert not parts.texts
    assert all(line.get_xdata()[0] == 0 for line in parts.get_lines())


def test_bins_of_distance_hold_equally_many_samples():
    rows = pd.DataFrame({DISTANCES[0]: range(20, 0, -1), "max_score": [0.1] * 10 + [0.5] * 10})
    distance, score, half = uncertainty_curves.distance_curve([rows[:5], rows[5:]])
    assert distance.tolist() == [1.5 + 2 * n for n in range(10)]
    assert score.tolist() == pytest.approx([0.5] * 5 + [0.1] * 5)
    assert half.tolist() == pytest.approx([0.0] * 10)
