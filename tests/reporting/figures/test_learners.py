import pytest

from baselines.registry import explainer_entry
from gpca.csv_file import write_csv
from gpca.errors import InputError
from gpca.reporting.figures.learners import draw_coverage_risk, draw_reliability, draw_uncertainty_vs_distance
from gpca.shift.learners import predict_sets
from gpca.shift.metrics import read_learner_predictions
from tests.shift.test_learners import quick
from tests.shift.test_sets import sets

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
        sets().save(path)
        set_files.append(path)
        for name, make in MAKE.items():
            predictions.append(folder / "learners" / source / name / "seed0.csv")
            write_csv(predictions[-1], predict_sets(make, sets()))
    return read_learner_predictions(predictions, set_files)


@pytest.mark.parametrize("draw", [draw_coverage_risk, draw_reliability, draw_uncertainty_vs_distance])
def test_a_figure_is_the_same_bytes_each_time(learned, draw, tmp_path):
    drawn = []
    for attempt in ("a", "b"):
        paths = [tmp_path / f"{attempt}.{suffix}" for suffix in ("pdf", "png")]
        draw(learned, SOURCES, LEARNERS, *paths)
        drawn.append([path.read_bytes() for path in paths])
    assert drawn[0] == drawn[1]
    assert len(drawn[0][1]) > 10000


@pytest.mark.parametrize("draw", [draw_coverage_risk, draw_reliability, draw_uncertainty_vs_distance])
def test_without_predictions_nothing_is_drawn(learned, draw, tmp_path):
    for sources, learners in (({"mugs": "Mugs"}, LEARNERS), (SOURCES, {"absent": "Absent"})):
        with pytest.raises(InputError, match="hold no predictions of these sources and learners"):
            draw(learned, sources, learners, tmp_path / "a.pdf", tmp_path / "a.png")
    assert not list(tmp_path.iterdir())
