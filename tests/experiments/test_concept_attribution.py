import csv
import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.metrics import collect
from gpca.declarations.plan import Run
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import COLUMNS, TIDY_COLUMNS, read_clustered
from gpca.experiments.concept_attribution import (
    collect_intervals,
    table1_extended,
    table1_single_baselines,
    table2_per_concept,
)
from gpca.io.csv_file import write_csv
from gpca.reporting.tables.table import Cell, Column, Table

CONCEPTS = ("noise", "pose", "overlap")
TURNED = {"noise": "pose", "pose": "overlap", "overlap": "noise"}


def predictions(seed):
    """Samples of four families, of which one is always misnamed, and a second with the second seed."""
    rows = []
    for sample in range(24):
        true, family = CONCEPTS[sample % 3], f"family {sample // 3 % 4}"
        wrong = family == "family 0" or (family == "family 1" and seed == 1)
        known = {"sample": sample, "split": "test", "object": family, "cluster": family, "concept_true": true}
        named = "" if sample == 0 else TURNED[true] if wrong else true
        scores = {f"score_{concept}": float(concept == named) for concept in CONCEPTS}
        rows.append(known | {"concept_predicted": named, "abstained": named == "", "icp_calls": 0} | scores)
    rows.append(rows[3] | {"sample": 99, "split": "train"})
    return pd.DataFrame(rows)


def test_values_are_those_of_the_metrics_with_intervals_over_families_and_seeds(tmp_path):
    files = []
    for seed in range(2):
        files.append(tmp_path / f"predictions/ycb/gpca/seed{seed}.csv")
        write_csv(files[-1], predictions(seed))
    write_csv(tmp_path / "intervals.csv", collect_intervals(files), form=None)
    collected = read_clustered(tmp_path / "intervals.csv").set_index(["metric", "concept"])
    metrics = collect(files).groupby(["metric", "concept"])["value"].mean()
    assert set(collected.index) == {("accuracy", concept) for concept in ("all", *CONCEPTS)}
    for key in collected.index:
        assert collected.loc[key, "value"] == pytest.approx(metrics[key])
    row = collected.loc["accuracy", "all"]
    assert (row["seeds"], row["clusters"], row["samples"]) == (2, 4, 48)
    assert row["high"] - row["low"] > 1.5 * np.ptp(wilson_interval(30, 48))  # far more than of independent samples
    assert ((collected["low"] < collected["value"]) & (collected["value"] < collected["high"])).all()


REAL = {"linemod": {"title": "LINEMOD", "stand_in": False}, "ycb": {"title": "YCB", "stand_in": False}}
EXPLAINERS = ("gpca_paper", "gpca", "shap_additive", "shap_oracle")
GPCA = "GP-CA (trained longer)"


def made(table, *numbers, sources=REAL, explainers=EXPLAINERS):
    """A table of a run with these sources and explainers."""
    return table(Run({"sources": sources, "explainers": dict.fromkeys(explainers)}, table.result.only), *numbers)


def tidy(accuracies, test_samples=200, seeds=3):
    """Intervals of 5 points about accuracies, by default over 200 test samples of a seed, 50 of each concept."""
    records = []
    for (source, explainer, concept), value in accuracies.items():
        samples = seeds * (test_samples if concept == "all" else 50)
        own = ("attribution", source, explainer, "accuracy", concept, seeds, 11, samples)
        records.append((*own, value, value - 0.03, min(1, value + 0.02)))
    return pd.DataFrame(records, columns=list(COLUMNS))


@pytest.fixture
def metrics():
    return tidy(
        {
            ("linemod", "gpca", "noise"): 0.997,
            ("linemod", "gpca", "pose"): 0.92,
            ("linemod", "gpca", "all"): 0.97,
            ("linemod", "shap_additive", "noise"): 0.4,
            ("linemod", "shap_additive", "all"): 0.3,
            ("ycb", "gpca", "all"): 0.95,
        }
    )


def test_table1_has_the_papers_explainers_with_predictions_in_its_order(metrics):
    markdown = made(table1_single_baselines, metrics).markdown()
    assert f"| Dataset | SHAP | {GPCA} |" in markdown
    # The dash stands where SHAP has no predictions.
    assert "| LINEMOD | 30.0 (27.0 to 32.0) | **97.0 (94.0 to 99.0)** |" in markdown
    assert "| YCB | – | 95.0 (92.0 to 97.0) |" in markdown
    assert (
        "Over 3 seeds, 200 test samples each; in brackets: the 95 % interval of a bootstrap over families" in markdown
    )
    assert "stand-in" not in markdown
    oracle = tidy({("ycb", "shap_oracle", "all"): 0.65}, seeds=2)
    assert made(table1_single_baselines, pd.concat([metrics, oracle])).markdown() == markdown


def test_table1_says_who_explains_fewer_samples_and_table2_has_only_gpca(metrics):
    both = pd.concat([metrics, tidy({("ycb", "shap_additive", "all"): 0.33}, test_samples=60)])
    both = both[(both["source"] == "ycb") | (both["method"] == "gpca")]
    footnotes = made(table1_single_baselines, both).footnotes
    assert "60 to 200 test samples each" in footnotes[0]
    assert footnotes[1] == f"Test samples explained: 200 by {GPCA}; 60 by SHAP."
    markdown = made(table2_per_concept, metrics).markdown()
    assert "| Dataset | Explainer | Noise | Pose | All |" in markdown
    assert f"| LINEMOD | {GPCA} | **99.7 (96.7 to 100.0)** | 92.0 (89.0 to 94.0) | 97.0 (94.0 to 99.0) |" in markdown
    assert "SHAP" not in markdown


def test_one_seed_has_an_interval_over_families_and_different_numbers_are_named():
    table = made(table1_single_baselines, tidy({("ycb", "gpca", "all"): 0.5}, seeds=1))
    assert "| YCB | 50.0 (47.0 to 52.0) |" in table.markdown()
    assert "Over 1 seed, 200 test samples each" in table.markdown()
    assert table.records()[1] == ("ycb", "gpca", 50.0, 47.0, 52.0, 1, 200, False)
    both = [tidy({(source, "gpca", "all"): 0.5}, seeds=seeds) for source, seeds in (("ycb", 2), ("linemod", 3))]
    assert "Over 2 to 3 seeds, 200 test" in made(table1_single_baselines, pd.concat(both)).markdown()


def test_csv_and_page_have_the_numbers_and_words_of_the_table(metrics, tmp_path):
    made(table1_single_baselines, metrics).write(tmp_path / "t")
    with (tmp_path / "t.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    gpca = next(row for row in rows if (row["source"], row["explainer"]) == ("linemod", "gpca"))
    assert float(gpca["mean"]) == 97.0
    assert (float(gpca["ci_low"]), float(gpca["ci_high"])) == (94, 99)
    assert (gpca["n_seeds"], gpca["n_test"]) == ("3", "600")
    assert len(rows) == 3
    assert (tmp_path / "t.md").read_text(encoding="utf-8").startswith("**Table I: Mean accuracy")
    table = made(table1_single_baselines, metrics)
    table.write(tmp_path / "t")
    printed = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert (printed["caption"], printed["label_columns"]) == (f"Table I: {table.caption}", 1)
    assert printed["footnotes"] == [*table.footnotes]
    assert printed["heads"][0] == "Dataset"
    [row, *_] = printed["rows"]
    bold = " | ".join(f"**{text}**" if best else text for text, best in row)
    assert f"| {bold} |" in table.markdown()


def test_ties_at_the_printed_precision_are_all_bold_unless_most_of_a_large_group_share_them():
    cells = {(0, "a"): Cell(99.96, 0, 3, 1), (0, "b"): Cell(100.0, 0, 3, 1), (0, "c"): Cell(98, 0, 3, 1)}
    columns = {name: Column(name.upper()) for name in "abc"}
    table = Table("t", "T", {"source": "S"}, ((("x", "X"),),), "column", columns, cells)
    assert replace(table, compared=(list(cells),)).best() == {(0, "a"), (0, "b")}
    assert replace(table, compared=([(0, "b"), (0, "c")],)).best() == {(0, "b")}
    assert replace(table, compared=([(0, "c")], [(1, "a")], [(0, "a"), (1, "a")])).best() == set()
    cells = {(row, "a"): Cell(0.0 if row < 7 else 1.0, 0, 3, 1) for row in range(12)}
    columns = {"a": Column("A", least_is_best=True)}
    rows = tuple((("x", str(row)),) for row in range(12))
    table = Table("t", "T", {"source": "S"}, rows, "column", columns, cells, compared=(list(cells),))
    assert table.best() == set()  # seven of twelve
    assert replace(table, compared=([key for key in cells if key[0] > 1],)).best() == {
        (row, "a") for row in range(2, 7)
    }


def full(source, explainer, accuracy, **metrics):
    """Intervals and metrics of one explainer as the collectors make them, the metrics the same over seeds."""
    given = {"abstention_rate": 0.125, "icp_calls": 400.0, "seconds_per_sample": 0.25, "test_samples": 200.0} | metrics
    own = ("attribution", source, explainer, "accuracy", "all", 3, 11, int(3 * given["test_samples"]))
    intervals = [(*own, accuracy, accuracy - 0.03, accuracy + 0.02)]
    records = [
        ("attribution", source, explainer, metric, "all", seed, value)
        for seed in range(3)
        for metric, value in given.items()
    ]
    return pd.DataFrame(intervals, columns=list(COLUMNS)), pd.DataFrame(records, columns=list(TIDY_COLUMNS))


@pytest.fixture
def everything():
    parts = [
        full("ycb", "gpca", 0.9, icp_calls=0.0, seconds_per_sample=0.0204),
        full("ycb", "shap_additive", 0.35, test_samples=60.0),
        full("ycb", "shap_oracle", 0.97),
        full("linemod", "gpca", 0.8),
    ]
    return tuple(pd.concat(part) for part in zip(*parts, strict=True))


def test_extended_has_a_row_per_explainer_and_a_unit_per_column_that_was_measured(everything):
    table = made(table1_extended, *everything)
    lines = table.markdown().splitlines()
    assert lines[2] == "| Dataset | Explainer | Reads | Accuracy (%) | Abstained (%) | ICP calls | Seconds | n |"
    constant = "12.5"
    assert lines[4] == f"| LINEMOD | {GPCA} | aligned source | 80.0 (77.0 to 82.0) | {constant} | 400 | 0.250 | 200 |"
    assert lines[5] == f"| YCB | {GPCA} | aligned source | **90.0 (87.0 to 92.0)** | {constant} | 0 | 0.020 | 200 |"
    assert lines[6].startswith("| YCB | SHAP | further runs | 35.0 (32.0 to 37.0) |")
    assert lines[6].endswith("| 12.5 | 400 | 0.250 | 60 |")
    assert "60 to 200 test samples each" in table.footnotes[0]
    assert "the one column that differs from run to run" in table.markdown()
    parts = (part[part["metric"] != "seconds_per_sample"] for part in everything)
    assert "| Seconds |" not in made(table1_extended, *parts).markdown()


def test_extended_sets_the_best_rival_in_bold_never_an_oracle_and_has_a_line_per_number(everything):
    table = made(table1_extended, *everything)
    assert table.best() == {(1, "accuracy")}
    assert [labels[1][1] for labels in table.rows if labels[0][0] == "ycb"] == [GPCA, "SHAP", "SHAP (oracle)"]
    records = table.records()
    heads = ("metric", "mean", "ci_low", "ci_high", "n_seeds", "n_test", "at_least")
    assert records[0] == ("source", "explainer", "reads", *heads)
    assert len(records) == 1 + 4 * 5
    assert ("ycb", "gpca", "aligned source", "seconds_per_sample", 0.0204, 0.0204, 0.0204, 3, 600, False) in records
    assert ("ycb", "shap_additive", "further runs", "accuracy", 35.0, 32.0, 37.0, 3, 180, False) in records
    assert ("ycb", "gpca", "aligned source", "icp_calls", 0.0, 0.0, 0.0, 3, 600, False) in records
