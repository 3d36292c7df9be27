import matplotlib.pyplot as plt
import numpy as np
import pytest

from gpca.causes.judged import measure
from gpca.evaluation.intervals import wilson_interval
from gpca.reporting.figures.reliability import draw_reliability_panel
from tests.judged import random_judged


def test_the_error_is_that_of_the_tables_and_a_calibrated_score_lies_on_the_diagonal(tmp_path):
    judged = random_judged(n=300)
    clear = judged.label != "borderline"
    _, panel = plt.subplots()
    gap = draw_reliability_panel(panel, judged.nominal[clear], judged.label[clear] == "nominal", bins=10)
    expected = measure(judged, np.ones((1, len(judged))))["nominal_calibration"][0]
    assert gap == pytest.approx(expected)
    plt.close()
    random = np.random.default_rng(0)
    probability = random.uniform(size=40000)
    _, panel = plt.subplots()
    gap = draw_reliability_panel(panel, probability, random.uniform(size=40000) < probability, bins=10)
    across, up = panel.get_lines()[-1].get_data()
    assert gap < 0.02
    assert np.abs(across - up).max() < 0.03
    plt.close()


def test_the_panel_is_square_and_counts_the_samples_of_each_bin():
    random = np.random.default_rng(0)
    probability = random.uniform(size=500) ** 3
    figure, panel = plt.subplots()
    draw_reliability_panel(panel, probability, random.uniform(size=500) < probability, bins=10)
    counts = figure.axes[1]
    expected = np.histogram(probability, bins=10, range=(0, 1))[0]
    assert [bar.get_height() for bar in counts.patches] == expected.tolist()
    assert counts.get_yscale() == "log" and counts.get_ylim()[1] > expected.max() ** 1.5
    assert panel.get_box_aspect() == counts.get_box_aspect() == 1
    assert panel.get_xlim() == panel.get_ylim()
    plt.close()


def test_every_point_has_its_wilson_interval():
    probability = np.repeat([0.25, 0.85], [8, 40])
    _, panel = plt.subplots()
    draw_reliability_panel(panel, probability, np.arange(48) % 4 > 0, bins=10)
    [lines] = panel.collections
    expected = [wilson_interval(6, 8), wilson_interval(30, 40)]
    assert [segment[:, 1].tolist() for segment in lines.get_segments()] == [pytest.approx(pair) for pair in expected]
    plt.close()
