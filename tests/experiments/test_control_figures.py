"""The figures of the controls: drawn of few numbers, the same bytes each time, refused where there is nothing."""

import numpy as np
import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS, POOLED
from gpca.experiments.control_tables import loophole
from gpca.experiments.severity_curves import COLUMNS as SEVERITIES
from gpca.experiments.severity_curves import REGISTRATION, SAMPLES, SUCCEEDS, severity_curves
from gpca.explainers.registry import explainer_entry

EXPLAINERS = {name: explainer_entry(name).title for name in ("gpca", "rule")}
SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
RUN = Run({"sources": SOURCES, "controls": {"explainers": dict.fromkeys(EXPLAINERS)}})


def severities():
    rows = []
    for method, value in ((REGISTRATION, 0.9), ("gpca", 0.8), ("rule", 0.4)):
        for low in (0.0, 0.5):
            rows += [(c, method, low, low + 0.5, np.nan, np.nan, 9, value) for c in ("noise", "overlap")]
            rows.append(("pose", method, 15 + low, 15.5 + low, 0.1, 0.2, 9, value))
    return pd.DataFrame(rows, columns=list(SEVERITIES))


def intervals():
    rows = [
        (control, POOLED, method, "accuracy", concept, "", "", 1, 4, 9, value, value - 0.1, value + 0.05)
        for control, concept, values in (
            ("paper", "all", (0.9, 0.95)),
            ("transfer", POOLED, (0.6, 0.9)),
            ("hard", "all", (0.5, 0.4)),
        )
        for method, value in zip(EXPLAINERS, values, strict=True)
    ]
    rows.append(("transfer", "ycb", "gpca", "accuracy", "cups", "", "", 1, 2, 9, 0.1, 0.0, 0.2))
    return pd.DataFrame(rows, columns=[*KEYS, *AGAINST, *NUMBERS])


DRAWN = [(lambda frame: severity_curves(RUN, frame), severities), (lambda frame: loophole(RUN, frame), intervals)]


@pytest.mark.parametrize(("draw", "numbers"), DRAWN)
def test_a_figure_is_the_same_bytes_each_time(draw, numbers, same_bytes):
    same_bytes(lambda: draw(numbers()))


def test_severities_are_numbers_with_their_samples_and_edges():
    figure = severity_curves(RUN, severities())
    noise, _, rotation, translation = figure.axes
    labels = [label.get_text().replace("\n", " ") for label in noise.get_yticklabels()]
    assert labels == [SAMPLES, SUCCEEDS.replace("\n", " "), *EXPLAINERS.values()]
    assert [label.get_text() for label in noise.get_xticklabels()] == ["0", "50", "100"]
    assert [label.get_text() for label in rotation.get_xticklabels()] == ["15", "15.5", "16"]
    assert [label.get_text() for label in translation.get_xticklabels()] == ["10", "20"]
    written = [text.get_text() for text in translation.texts]
    assert sorted(written) == sorted(["18", "90", "80", "40"])  # Two bins of rotation have this translation.


def test_bins_of_one_severity_are_weighted_by_their_samples():
    rows = severities()
    many = (rows["method"] == "gpca") & (rows["concept"] == "pose") & (rows["low"] == 15)
    rows.loc[many, ["samples", "value"]] = [27, 0.4]
    translation = severity_curves(RUN, rows).axes[3]
    assert "50" in [text.get_text() for text in translation.texts]  # (27 * 40 + 9 * 80) / 36


def test_each_explainer_is_a_line_over_the_steps_that_were_run_and_ends_with_its_number():
    [panel] = loophole(RUN, intervals()).axes
    lines = {container.get_label(): container for container in panel.containers}
    assert set(lines) == set(EXPLAINERS.values())
    assert lines[EXPLAINERS["gpca"]].lines[0].get_ydata() == pytest.approx([90, 60, 50])
    assert lines[EXPLAINERS["rule"]].lines[0].get_ydata() == pytest.approx([95, 90, 40])
    assert {text.get_text() for text in panel.texts} == {"50", "40"}
    assert [np.round(x) for x in lines[EXPLAINERS["gpca"]].lines[0].get_xdata()] == [0, 2, 3]  # no unseen objects


@pytest.mark.parametrize(("draw", "numbers"), DRAWN)
def test_numbers_of_others_make_no_figure(draw, numbers):
    frame = numbers()
    with pytest.raises(InputError, match="have no"):
        draw(frame[frame["method"] == REGISTRATION])
