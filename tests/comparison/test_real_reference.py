"""The reference run on real objects: its comparison and the reasons."""

import pandas as pd
import pytest
import yaml

from gpca.comparison.claims import counted, read_verdicts
from gpca.comparison.markdown import counts_table, summary
from gpca.comparison.published import NONE_YET, read_published, read_reasons
from gpca.comparison.readings import READINGS, judge_readings, with_readings
from gpca.comparison.values import read_results
from gpca.comparison.verdicts import JUDGED, NOT_COMPARABLE, compare
from gpca.experiments import reading_words
from gpca.process.code_files import ROOT

from .made_up import TOLERANCES


def reference():
    folder = ROOT / "results/reference/full"
    sources = yaml.safe_load((ROOT / "config/sources.yaml").read_text())["sources"]
    objects = {name: {"title": name, "stand_in": False} for name in (*sources, "real_rgbd", "model")}
    numbers = read_published()
    named = {number.counterpart.file for number in numbers if number.counterpart}
    results = read_results(path for path in sorted(folder.glob("*.csv")) if path.name in named | {READINGS})
    comparison = compare(numbers, results, objects, TOLERANCES, read_reasons())
    judged = judge_readings(numbers, comparison, results[READINGS], TOLERANCES)
    return with_readings(comparison, judged, reading_words)


@pytest.fixture(scope="module")
def shown():
    """The comparison that the reference keeps."""
    texts = dict.fromkeys(("repeat_of", "reason", "objects", "hardware"), "")
    return pd.read_csv(ROOT / "results/reference/full/comparison.csv").fillna(texts)


def test_the_comparison_of_the_reference_is_that_of_its_numbers(shown):
    rows = reference()
    assert len(rows) == len(shown) == 112
    # The file behind Table V is too large to be kept.
    kept = (rows["verdict"] != "not run").to_numpy()
    assert set(rows.loc[~kept, "table"]) <= {"V"}
    numbers = ("published", "paper_low", "paper_high", "reproduced")
    for column in ("table", "row", "column", *numbers, "repeat_of"):
        assert rows.loc[kept, column].tolist() == pytest.approx(shown.loc[kept, column].tolist(), nan_ok=True)
    # Predictions are not kept either: where they widen the interval, the verdict may have become another.
    kept = kept & shown["cluster_low"].isna().to_numpy()
    assert kept.sum() > 30
    assert rows.loc[kept, "ci_low"].tolist() == pytest.approx(shown.loc[kept, "ci_low"].tolist(), nan_ok=True)
    for column in ("verdict", "reason", "over_objects"):
        assert rows.loc[kept, column].tolist() == shown.loc[kept, column].tolist()


def test_every_miss_has_a_reason_every_repeat_its_value_and_the_pages_count_the_verdicts(shown):
    assert shown[shown["reason"] == NONE_YET][["table", "row", "column"]].to_numpy().tolist() == []
    assert (shown.loc[shown["verdict"] != "reproduced", "reason"] != "").all()
    assert set(JUDGED) <= set(shown["verdict"]) <= {*JUDGED, NOT_COMPARABLE}
    judged = shown["verdict"].isin(JUDGED)
    assert not (shown.loc[judged, "reason"] == "procedural stand-in").any()
    values = {" / ".join(row[:3]): row[3] for row in shown[["table", "row", "column", "reproduced"]].to_numpy()}
    repeats = shown[shown["repeat_of"] != ""]
    assert len(repeats) == 7
    assert repeats["reproduced"].tolist() == [values[key] for key in repeats["repeat_of"]]
    page = (ROOT / "results/reference/full/comparison.md").read_text()
    assert counts_table(shown, TOLERANCES) in page
    assert summary(shown) in page
    verdicts = read_verdicts(ROOT / "results/reference/full/claims.csv")
    assert counted(verdicts) in (ROOT / "results/reference/full/tables/claims.md").read_text()
