"""The figures of the controls: drawn of few numbers, the same bytes each time, refused where there is nothing."""

import numpy as np
import pandas as pd
import pytest

from gpca.controls.intervals import COLUMNS as INTERVALS
from gpca.controls.severity import COLUMNS as SEVERITIES
from gpca.controls.severity import REGISTRATION
from gpca.errors import InputError
from gpca.reporting.figures.severity_curves import draw_severity_curves
from gpca.reporting.figures.transfer import draw_transfer

EXPLAINERS = {"good": "Good", "poor": "Poor (forest)"}
SOURCES = {"ycb": "YCB", "cups": "Cups"}


def severities():
    rows = []
    for method, value in ((REGISTRATION, 0.9), ("good", 0.8), ("poor", 0.4)):
        for low in (0.0, 0.5):
            rows += [(c, method, low, low + 0.5, np.nan, np.nan, 9, value) for c in ("noise", "overlap")]
            rows.append(("pose", method, 15 + low, 15.5 + low, 0.1, 0.2, 9, value))
    return pd.DataFrame(rows, columns=list(SEVERITIES))


def intervals():
    rows = [
        ("paper" if one == other else "transfer", one, other, method, "accuracy", 9, 1, 0.5, *[np.nan] * 5)
        for one in SOURCES
        for other in SOURCES
        for method in EXPLAINERS
    ]
    return pd.DataFrame(rows, columns=list(INTERVALS))


DRAWN = [
    (lambda frame, *files: draw_severity_curves(frame, EXPLAINERS, "Title", *files), severities),
    (lambda frame, *files: draw_transfer(frame, SOURCES, EXPLAINERS, *files), intervals),
]


@pytest.mark.parametrize(("draw", "numbers"), DRAWN)
def test_a_figure_is_the_same_bytes_each_time(draw, numbers, tmp_path):
    written = []
    for name in ("one", "two"):
        files = [tmp_path / f"{name}.{suffix}" for suffix in ("pdf", "png")]
        draw(numbers(), *files)
        written.append([file.read_bytes() for file in files])
    assert written[0] == written[1]
    assert all(len(data) > 2000 for data in written[0])


@pytest.mark.parametrize(("draw", "numbers"), DRAWN)
def test_numbers_of_others_make_no_figure(draw, numbers, tmp_path):
    frame = numbers()
    with pytest.raises(InputError, match="have no"):
        draw(frame[frame["method"] == REGISTRATION], tmp_path / "a.pdf", tmp_path / "a.png")
