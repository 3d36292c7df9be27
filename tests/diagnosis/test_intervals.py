import numpy as np
import pytest

from gpca.attribution.metrics import write_metrics
from gpca.diagnosis import intervals
from gpca.diagnosis.intervals import collect, pigeonhole_weights, read_intervals
from gpca.diagnosis.judged import CEILING
from gpca.errors import InputError

from .conftest import random_judged
from .files import write_run


def test_a_draw_of_objects_and_seeds_weighs_a_sample_by_both(judged):
    weights = pigeonhole_weights((judged.seed, judged.instance), "tiny")
    assert np.array_equal(weights, pigeonhole_weights((judged.seed, judged.instance), "tiny"))
    assert not np.array_equal(weights, pigeonhole_weights((judged.seed, judged.instance), "other"))
    for seed, instance in ((100, "cup"), (101, "drill")):
        same = weights[:, (judged.seed == seed) & (judged.instance == instance)]
        assert (same == same[:, :1]).all()
    one_each = [weights[:, np.flatnonzero((judged.seed == s) & (judged.instance == i))[0]]
                for s in (100, 101) for i in ("cup", "can", "drill")]  # fmt: skip
    assert (np.sum(one_each, axis=0) == 2 * 3).all()  # as many seeds and objects are drawn as there are


def test_of_two_explainers_the_better_leads_by_what_the_other_lacks():
    good, poor = random_judged(200, skill=2.0), random_judged(200, skill=0.3)
    rows = {row[1]: row for row in intervals._of_source("tiny", {"good": good, "poor": poor, CEILING: good})
            if row[2] == "balanced_accuracy"}  # fmt: skip
    record = dict(zip(intervals.COLUMNS, rows["good"], strict=True))
    assert record["low"] <= record["value"] <= record["high"]
    assert record["rival"] == "poor"
    assert 0 < record["difference_low"] < record["difference"] < record["difference_high"]
    assert rows["poor"][9] == pytest.approx(-record["difference"])
    assert rows[CEILING][8] == ""


def test_a_run_is_collected_written_and_read(causes, tmp_path):
    rows = collect(*write_run(tmp_path, causes))
    assert set(rows["method"]) == {CEILING, "right", "always_pose"}
    assert set(rows["source"]) == {"four"}
    write_metrics(rows, tmp_path / "intervals.csv")
    read = read_intervals(tmp_path / "intervals.csv")
    right = read[(read["method"] == "right") & (read["metric"] == "balanced_accuracy")].iloc[0]
    assert (right["value"], right["rival"]) == (1.0, "always_pose")
    assert np.isnan(read[read["method"] == CEILING]["difference"]).all()
    (tmp_path / "intervals.csv").write_text((tmp_path / "intervals.csv").read_text().replace(",1.0,", ",one,", 1))
    with pytest.raises(InputError, match="holds something that is not a finite number"):
        read_intervals(tmp_path / "intervals.csv")
