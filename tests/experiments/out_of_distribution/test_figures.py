import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.out_of_distribution.figures import (
    distance_curve,
    draw_coverage_risk,
    draw_reliability,
    draw_uncertainty_vs_distance,
)
from gpca.experiments.out_of_distribution.learners import predict_sets
from gpca.experiments.out_of_distribution.metrics import read_learner_predictions, sets_of, uncertainty_metrics
from gpca.experiments.out_of_distribution.sets import DISTANCES
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import write_csv
from gpca.reporting.figures import style
from tests.experiments.out_of_distribution.test_learners import quick
from tests.experiments.out_of_distribution.test_sets import sets

SOURCES = {"cups": "Cups (procedural stand-in)", "parts": "Parts"}
LEARNERS = {"gpca": "GPC", "learner_nearest": "k nearest", "mine": "Mine", "absent": "Absent"}
MAKE = {
    "gpca": quick,
    "learner_nearest": lambda: explainer_entry("learner_nearest").make("tiny", 0),
    "mine": lambda: explainer_entry("learner_logistic").make("tiny", 0),
}


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
    return read_learner_predictions(predictions, set_files)


@pytest.mark.parametrize("draw", [draw_coverage_risk, draw_reliability, draw_uncertainty_vs_distance])
def test_a_figure_is_the_same_bytes_each_time(learned, draw, same_bytes):
    same_bytes(lambda: draw(learned, SOURCES, LEARNERS))


@pytest.mark.parametrize("draw", [draw_coverage_risk, draw_reliability, draw_uncertainty_vs_distance])
def test_without_predictions_nothing_is_drawn(learned, draw):
    for sources, learners in (({"mugs": "Mugs"}, LEARNERS), (SOURCES, {"absent": "Absent"})):
        with pytest.raises(InputError, match="have no predictions of these sources and learners"):
            draw(learned, sources, learners)


def test_rho_is_the_tables_alone_and_with_each_shift(learned):
    figure = draw_uncertainty_vs_distance(learned, SOURCES, LEARNERS)
    written = [[text.get_text() for text in panel.texts] for panel in figure.axes]
    names = ("in_distribution", "in_distribution+severity", "seen_objects+objects")  # There is no other source.
    assert len(figure.axes) == len(names) * len(SOURCES)
    rho = f"rho_max_score_{DISTANCES[0]}"
    for row, name in enumerate(names):
        for column, source in enumerate(SOURCES):
            expected = uncertainty_metrics(sets_of(learned[source, "gpca", 0])[name])[rho]
            assert f"a {expected:.3f}" in written[2 * row + column], (name, source)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a: GPC", "2 others"]


@pytest.mark.parametrize("draw", [draw_coverage_risk, draw_uncertainty_vs_distance])
def test_the_papers_learners_have_a_color_and_the_others_are_gray(learned, draw):
    figure = draw(learned, SOURCES, LEARNERS)
    colors = [line.get_color() for line in figure.axes[0].get_lines()]
    assert colors == [style.LIGHT_GRAY, style.LIGHT_GRAY, style.BLUE]  # in the order of drawing
    assert [text.get_text()[-8:] for text in figure.legends[0].get_texts()] == [
        "GPC" if draw is draw_coverage_risk else "a: GPC",
        "2 others",
    ]


def test_curves_of_risk_start_where_a_tenth_is_covered_and_a_panel_without_errors_says_so(learned):
    right = {
        key: rows.assign(concept_predicted=rows["concept_true"], abstained=False) if key[0] == "cups" else rows
        for key, rows in learned.items()
    }
    wrong = {
        key: rows.assign(concept_predicted="none", abstained=False) if key[0] == "parts" else rows
        for key, rows in right.items()
    }
    cups, parts = draw_coverage_risk(wrong, SOURCES, LEARNERS).axes
    assert [text.get_text() for text in cups.texts] == ["no errors"]
    assert not parts.texts
    assert all(line.get_xdata()[0] == 10 for line in parts.get_lines())


def test_bins_of_distance_hold_equally_many_samples():
    rows = pd.DataFrame({DISTANCES[0]: range(20, 0, -1), "max_score": [0.1] * 10 + [0.5] * 10})
    distance, score = distance_curve([rows[:5], rows[5:]])
    assert distance.tolist() == [1.5 + 2 * n for n in range(10)]
    assert score.tolist() == pytest.approx([0.5] * 5 + [0.1] * 5)
