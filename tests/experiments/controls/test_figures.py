"""The figures of the controls: drawn of few numbers, the same bytes each time, refused where there is nothing."""

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.paired import Difference
from gpca.errors import InputError
from gpca.experiments.controls.figures import SUCCEEDS, draw_severity_curves, draw_transfer
from gpca.experiments.controls.metrics import COLUMNS as INTERVALS
from gpca.experiments.controls.severity import COLUMNS as SEVERITIES
from gpca.experiments.controls.severity import REGISTRATION

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
        (
            "paper" if one == other else "transfer",
            one,
            other,
            method,
            "accuracy",
            9,
            1,
            0.5,
            *[np.nan] * 5,
            *Difference().cells * 2,
        )
        for one in SOURCES
        for other in SOURCES
        for method in EXPLAINERS
    ]
    return pd.DataFrame(rows, columns=list(INTERVALS))


DRAWN = [
    (lambda frame: draw_severity_curves(frame, EXPLAINERS, "Title"), severities),
    (lambda frame: draw_transfer(frame, SOURCES, EXPLAINERS), intervals),
]


@pytest.mark.parametrize(("draw", "numbers"), DRAWN)
def test_a_figure_is_the_same_bytes_each_time(draw, numbers, same_bytes):
    same_bytes(lambda: draw(numbers()))


def test_severities_have_scales_of_their_values_and_success_lies_on_top():
    figure = draw_severity_curves(severities(), EXPLAINERS, "Title")
    noise, _, *maps = figure.axes
    assert noise.get_ylim()[0] == 30  # the least value is 40 %
    assert noise.get_lines()[-1].get_label() == SUCCEEDS
    looks = {(line.get_color(), str(line.get_linestyle()), line.get_marker()) for line in noise.get_lines()}
    assert len(looks) == len(noise.get_lines()) == 3
    [mesh] = maps[0].collections
    assert mesh.get_clim() == (30, 100)


def test_a_map_with_none_below_it_has_numbers_on_its_axis():
    names = [f"explainer_{i}" for i in range(5)]
    parts = [severities()] + [severities().query("method == 'good'").assign(method=name) for name in names]
    figure = draw_severity_curves(pd.concat(parts), dict(zip(names, names, strict=True)), "Title")
    maps = [axes for axes in figure.axes[2:] if axes.get_visible()][:6]
    shown = [axes.xaxis.get_tick_params()["labelbottom"] for axes in maps]
    assert shown == [False, False, True, True, True, True]


@pytest.mark.parametrize(("draw", "numbers"), DRAWN)
def test_numbers_of_others_make_no_figure(draw, numbers):
    frame = numbers()
    with pytest.raises(InputError, match="have no"):
        draw(frame[frame["method"] == REGISTRATION])
