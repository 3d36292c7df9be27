"""What shuffled values score, and what values in their places do."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

from gpca.comparison.chance import ALL, chance
from gpca.seeds import generator

from .made_up import ACCURACY, TIME, TOLERANCES, compared, number, runtime, tidy

PRINTED = 40.0 + 5 * np.arange(10)


def comparison(values, **more):
    """Of ten numbers of one column, each beside two equal repeats of a value in percent."""
    numbers = [
        number(value, row=f"row {i}", counterpart=replace(ACCURACY, methods=(f"m{i}",)), **more)
        for i, value in enumerate(PRINTED)
    ]
    tidies = [tidy([value / 100, value / 100], method=f"m{i}") for i, value in enumerate(values)]
    return compared(numbers, {"metrics.csv": pd.concat(tidies)})


def test_values_in_their_places_agree_more_often_than_by_chance_and_shuffled_ones_do_not():
    found = chance(comparison(PRINTED + 0.5), TOLERANCES)["I"]
    assert (found.agree, found.expected, found.rho) == (10, 1.0, 1.0)  # ten of ten, and one by chance
    assert found.p == pytest.approx(1 / 10001)
    values = generator("test of chance", "again").permutation(PRINTED)
    assert chance(comparison(values), TOLERANCES) == chance(comparison(values), TOLERANCES)
    p_values = []
    for repeat in range(40):
        values = generator("test of chance", repeat).permutation(PRINTED) + 0.5
        found = chance(comparison(values), TOLERANCES)
        assert found[ALL] == found["I"]
        assert found["I"].expected == 1.0
        assert found["I"].rho == pytest.approx(spearmanr(PRINTED, values).statistic)
        p_values.append(found["I"].p)
    # As many shuffles are as good as this one in about so many cases, and rarely few are.
    assert np.mean(p_values) > 0.5
    assert sum(p < 0.05 for p in p_values) <= 5


def test_times_are_shuffled_in_seconds_and_single_values_not_at_all():
    def of(component):
        return replace(TIME, methods=(component,))

    numbers = [number(3.0, unit="s", counterpart=of("icp")), number(3.0, unit="ms", counterpart=of("scores"), row="b")]
    found = chance(compared(numbers, {"runtime.csv": runtime(icp=0.003, scores=3.0)}), TOLERANCES)["I"]
    assert (found.agree, found.expected) == (0, 1.0)  # exchanged, both would agree
    assert found.rho == pytest.approx(-1)
    alone = chance(compared(numbers[:1], {"runtime.csv": runtime(icp=3.0)}), TOLERANCES)["I"]
    assert (alone.agree, alone.expected) == (1, 1.0)
    assert np.isnan([alone.p, alone.rho]).all()


def test_repeats_and_what_was_not_judged_do_not_count():
    rows = comparison(PRINTED)
    rows.loc[0, "repeat_of"], rows.loc[1, "verdict"], rows.loc[2, "statistic"] = "I / YCB / SA", "not run", "deviation"
    assert chance(rows, TOLERANCES)["I"].agree == 7
    assert chance(rows[:3], TOLERANCES) == {}
