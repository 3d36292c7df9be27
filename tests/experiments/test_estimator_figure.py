"""The figure of estimators."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2

from gpca.errors import InputError
from gpca.experiments.estimator_figure import LEVELS, STYLES, coverages, draw_estimators
from gpca.io.csv_file import write_csv
from gpca.uncertainty.estimates import JUDGED, REFERENCES, covariance_columns, read_estimate_files
from gpca.uncertainty.estimators.registry import estimator_entry

from .runs import run_with

ESTIMATORS = ("censi", "brossard")
RUN = run_with(
    estimators=dict.fromkeys(ESTIMATORS),
    estimator_pairs={"methods": {"point_to_point": 8}},
    sources={"cups": {"title": "Cups", "kind": "procedural"}},
)


@pytest.fixture
def files(tmp_path):
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
    return paths


def drawn(paths):
    return draw_estimators(RUN, read_estimate_files(paths))


def test_the_figure_is_the_same_bytes_each_time(files, same_bytes):
    same_bytes(lambda: drawn(files))


def test_estimates_that_are_missing_are_refused(files):
    with pytest.raises(InputError, match="are none of reference_starts"):
        drawn(files[1:])


def test_every_estimator_is_named_and_so_are_the_sides_of_the_diagonals(files):
    figure = drawn(files)
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    references = ["Other starts", "Other data", "Other starts and data"]
    assert names == [*references, *RUN.titles(estimator_entry, ESTIMATORS).values(), "succeeded", "failed"]
    sides = {panel.get_title(): [text.get_text() for text in panel.texts] for panel in figure.axes}
    assert sides["Other starts and data"] == ["too confident", "too cautious"]  # above the diagonal, and below
    assert sides["Coverage, succeeded"] == ["too cautious"]  # above it


def test_estimators_of_one_color_differ_in_their_line():
    looks = [(color, str(line)) for color, line in STYLES.values()]
    assert len(set(looks)) == len(looks)
    assert STYLES["bayesian_icp"][0] != STYLES["stein_icp"][0]


def test_a_right_covariance_lies_on_the_diagonal():
    squares = np.random.default_rng(0).chisquare(6, size=20_000)
    assert coverages(squares) == pytest.approx(LEVELS, abs=0.015)
