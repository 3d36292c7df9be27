"""The figure of estimators."""

import numpy as np
import pytest
from scipy.stats import chi2

from gpca.csv_file import write_csv
from gpca.errors import InputError
from gpca.reporting.figures.estimators import LEVELS, coverages, draw_estimators, ellipse
from gpca.trials.covariances import ReferenceSamples, covariance_columns, read_estimate_files

ESTIMATORS, METHODS = {"censi": "Censi", "own": "Own"}, {"point_to_point": "ICP"}


@pytest.fixture
def files(tmp_path):
    import pandas as pd

    random = np.random.default_rng(0)
    frame = pd.DataFrame(
        {
            "sample": np.arange(8), "object": "cup", "method": "point_to_point", "failed": np.arange(8) > 3,
            "add_relative": np.linspace(0.005, 0.2, 8), "failure": "", "kl_rotation": 0.1, "kl_translation": 0.1,
            "error_ratio": 1.0, "mahalanobis": chi2.ppf(np.linspace(0.1, 0.9, 8), 6), "spread": 0.03,
        } | covariance_columns(1e-3 * np.eye(6))
    )  # fmt: skip
    paths = []
    for name in ("reference", *ESTIMATORS):
        path = tmp_path / "cups" / name / "seed0.csv"
        path.parent.mkdir(parents=True)
        write_csv(path, frame)
        paths.append(path)
    samples = ReferenceSamples(
        np.arange(8), np.full(8, "point_to_point"), 0.03 * random.normal(size=(240, 6)), np.arange(0, 241, 30),
        0.01 * np.ones((8, 6)),
    )  # fmt: skip
    (tmp_path / "samples" / "cups").mkdir(parents=True)
    samples.save(tmp_path / "samples/cups/seed0.npz")
    return paths, tmp_path / "samples/cups/seed0.npz"


def drawn(files, folder):
    paths, samples = files
    draw_estimators(
        read_estimate_files(paths), samples, ESTIMATORS, METHODS, "Cups", folder / "a.pdf", folder / "a.png"
    )
    return (folder / "a.png").read_bytes()


def test_both_files_are_written_and_the_same_again(files, tmp_path):
    first = drawn(files, tmp_path)
    assert (tmp_path / "a.pdf").stat().st_size > 1000
    assert drawn(files, tmp_path) == first


def test_samples_without_their_estimates_are_refused(files, tmp_path):
    paths, samples = files
    with pytest.raises(InputError, match="has no estimates of cups, seed 0"):
        drawn((paths[1:], samples), tmp_path)


def test_an_ellipse_holds_what_it_says():
    sigma = np.array([[2.0, 0.6], [0.6, 0.5]])
    outline = ellipse(sigma)
    distance = np.einsum("ni,ij,nj->n", outline, np.linalg.inv(sigma), outline)
    assert distance == pytest.approx(np.full(len(outline), chi2.ppf(0.95, 2)))


def test_a_right_covariance_lies_on_the_diagonal():
    squares = np.random.default_rng(0).chisquare(6, size=20_000)
    assert coverages(squares) == pytest.approx(LEVELS, abs=0.015)
