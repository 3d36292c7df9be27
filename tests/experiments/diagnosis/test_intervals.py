import numpy as np
import pytest

from gpca.attribution.metrics import write_metrics
from gpca.causes.truth import BORDERLINE
from gpca.errors import InputError
from gpca.experiments.diagnosis import intervals
from gpca.experiments.diagnosis.intervals import collect, read_intervals
from gpca.experiments.diagnosis.judged import CEILING, Judged
from tests.experiments.diagnosis.conftest import random_judged
from tests.experiments.diagnosis.files import write_run


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
    assert record["samples"] == (good.label != BORDERLINE).sum() < len(good)


def test_a_run_is_collected_written_and_read(causes, tmp_path):
    rows = collect(*write_run(tmp_path, causes))
    assert set(rows["method"]) == {CEILING, "right", "always_pose"}
    assert set(rows["source"]) == {"four"}
    write_metrics(rows, tmp_path / "intervals.csv")
    read = read_intervals(tmp_path / "intervals.csv")
    right = read[(read["method"] == "right") & (read["metric"] == "balanced_accuracy")].iloc[0]
    assert (right["value"], right["rival"]) == (1.0, "always_pose")
    assert np.isnan(read[read["method"] == CEILING]["difference"]).all()
    # A difference may be missing, but what stands there has to be a number.
    for column in ("value", "difference"):
        write_metrics(rows.astype({column: object}).assign(**{column: "one"}), tmp_path / "intervals.csv")
        with pytest.raises(InputError, match=f"column '{column}' contains values that are not finite numbers"):
            read_intervals(tmp_path / "intervals.csv")


def test_a_label_that_no_sample_has_leaves_measures_out_and_the_rest_readable(tmp_path):
    judged = random_judged(60)
    kept = Judged(**{name: array[judged.label != "noise"] for name, array in vars(judged).items()})
    rows = intervals._of_source("tiny", {"one": kept, "other": kept})
    assert "auroc_failed" in {row[2] for row in rows}
    assert np.isfinite([row[5] for row in rows]).all()
