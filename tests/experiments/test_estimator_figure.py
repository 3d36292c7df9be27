"""The figure of estimators."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from gpca.errors import InputError
from gpca.experiments.estimator_figure import (
    LEVELS,
    STYLES,
    WIDEST,
    coverages,
    draw_ellipses,
    draw_estimators,
    ellipse,
)
from gpca.io.csv_file import write_csv
from gpca.reporting.figures.style import GRAY
from gpca.uncertainty.estimates import (
    JUDGED,
    KINDS,
    REFERENCES,
    ReferenceSamples,
    covariance_columns,
    read_estimate_files,
)
from gpca.uncertainty.estimators.registry import estimator_entry

from .runs import run_with

ESTIMATORS = ("censi", "brossard")
RUN = run_with(
    estimators=dict.fromkeys(ESTIMATORS),
    estimator_pairs={"methods": {"point_to_point": 8}},
    figures={"source": "cups"},
)


@pytest.fixture
def files(tmp_path):
    random = np.random.default_rng(0)
    frame = pd.DataFrame(
        {
            "sample": np.arange(8), "object": "cup", "method": "point_to_point", "failed": np.arange(8) > 3,
            "add_relative": np.linspace(0.005, 0.2, 8), "failure": "", "cluster": "cups",
            "inlier_rmse": 0.01, "fitness": 1,
            **dict.fromkeys(JUDGED, 1.0), "mahalanobis": chi2.ppf(np.linspace(0.1, 0.9, 8), 6), "spread": 0.03,
        } | covariance_columns(1e-3 * np.eye(6))
    )  # fmt: skip
    paths = []
    for name in (*REFERENCES, *ESTIMATORS):
        path = tmp_path / "cups" / name / "seed0.csv"
        path.parent.mkdir(parents=True)
        write_csv(path, frame)
        paths.append(path)
    samples = ReferenceSamples(
        np.repeat(np.arange(8), 3), np.full(24, "point_to_point"), np.tile(KINDS, 8),
        0.03 * random.normal(size=(720, 6)), np.arange(0, 721, 30), 0.01 * np.ones((24, 6)),
    )  # fmt: skip
    (tmp_path / "samples" / "cups").mkdir(parents=True)
    samples.save(tmp_path / "samples/cups/seed0.npz", ("cups", 0))
    return paths, tmp_path / "samples/cups/seed0.npz"


def drawn(paths, samples):
    return draw_estimators(RUN, read_estimate_files(paths), samples)


def test_the_figure_is_the_same_bytes_each_time(files, same_bytes):
    same_bytes(lambda: drawn(*files))


def test_samples_without_their_estimates_are_refused(files):
    paths, samples = files
    with pytest.raises(InputError, match="has no estimates of cups, seed 0"):
        drawn(paths[1:], samples)


def test_the_references_are_seen_above_and_the_axes_are_named(files):
    figure = drawn(*files)
    titles = RUN.titles(estimator_entry, ESTIMATORS).values()
    names = [text.get_text() for text in figure.subfigs[0].legends[0].get_texts()]
    references = ["Other starts", "Other data", "Other starts and data"]
    assert names[:5] == [*references, *titles]
    assert names[5:] == ["results of other starts and data", "true pose", "succeeded", "failed"]
    upper = figure.axes[:4]
    assert [panel.get_ylabel() for panel in upper] == [
        f"second axis ({unit})" for unit in ("degrees", "% of the diameter") * 2
    ]
    assert all(GRAY in [line.get_color() for line in panel.get_lines()] for panel in upper)
    sides = {panel.get_title(): [text.get_text() for text in panel.texts] for panel in figure.axes[4:]}
    assert sides["Other starts and data"] == ["too confident", "too cautious"]  # above the diagonal, and below
    assert sides["Coverage, succeeded"] == ["too cautious"]  # above it


def test_estimators_of_one_color_differ_in_their_line():
    looks = [(color, str(line)) for color, line in STYLES.values()]
    assert len(set(looks)) == len(looks)
    assert STYLES["bayesian_icp"][0] != STYLES["stein_icp"][0]


@pytest.mark.parametrize(("times", "whole"), [(1.5, True), (10.0, False)])
def test_an_ellipse_is_drawn_whole_or_named_where_it_is_far_wider(times, whole):
    import matplotlib.pyplot as plt

    random = np.random.default_rng(0)
    twists = random.normal(size=(400, 6))
    samples = ReferenceSamples(
        np.array([0]), np.array(["icp"]), np.array(["all"]), twists, np.array([0, 400]), np.zeros((1, 6))
    )
    deviation = times * 2.6 / np.sqrt(-2 * np.log(0.05))  # of an ellipse that is so many times as wide as the dots
    row = pd.Series(covariance_columns(deviation**2 * np.eye(6)))
    figure, panel = plt.subplots()
    left_out = draw_ellipses(panel, samples, 0, {"own": row, "censi": None}, slice(0, 3), 1.0)
    assert left_out == ([] if whole else ["own"])
    *outlines, _ = panel.get_lines()
    edge = panel.get_xlim()[1]
    assert [np.abs(outline.get_xydata()).max() < edge for outline in outlines] == [True] * whole
    assert edge < 1.1 * WIDEST * 3.0
    plt.close(figure)


def test_an_ellipse_holds_what_it_says_and_a_right_covariance_lies_on_the_diagonal():
    sigma = np.array([[2.0, 0.6], [0.6, 0.5]])
    outline = ellipse(sigma)
    distance = np.einsum("ni,ij,nj->n", outline, np.linalg.inv(sigma), outline)
    assert distance == pytest.approx(np.full(len(outline), chi2.ppf(0.95, 2)))
    squares = np.random.default_rng(0).chisquare(6, size=20_000)
    assert coverages(squares) == pytest.approx(LEVELS, abs=0.015)
