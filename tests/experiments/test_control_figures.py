"""The figures of the controls: drawn of few numbers, the same bytes each time, refused where there is nothing."""

import numpy as np
import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS, POOLED
from gpca.experiments.control_tables import loophole
from gpca.explainers.registry import explainer_entry

EXPLAINERS = {name: explainer_entry(name).title for name in ("gpca", "rule")}
SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
RUN = Run({"sources": SOURCES, "controls": {"explainers": dict.fromkeys(EXPLAINERS)}})


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


def test_each_explainer_is_a_line_over_the_steps_that_were_run_and_the_bytes_repeat(same_bytes):
    [panel] = loophole(RUN, intervals()).axes
    lines = {container.get_label(): container for container in panel.containers}
    assert set(lines) == set(EXPLAINERS.values())
    assert lines[EXPLAINERS["gpca"]].lines[0].get_ydata() == pytest.approx([90, 60, 50])
    assert lines[EXPLAINERS["rule"]].lines[0].get_ydata() == pytest.approx([95, 90, 40])
    assert {text.get_text() for text in panel.texts} == {"50", "40"}
    assert [np.round(x) for x in lines[EXPLAINERS["gpca"]].lines[0].get_xdata()] == [0, 2, 3]  # no unseen objects
    same_bytes(lambda: loophole(RUN, intervals()))
    with pytest.raises(InputError, match="have no"):
        loophole(RUN, intervals().query("method == 'registration'"))
