import csv
import json
import math
from dataclasses import replace

import pandas as pd
import pytest

from gpca.attribution.confidence import wilson_interval
from gpca.attribution.metrics import TIDY_COLUMNS
from gpca.errors import InputError
from gpca.experiments.concept_attribution.tables import table1_extended, table1_single_baselines, table2_per_concept
from gpca.reporting.tables.table import Cell, Column, Table

REAL = {"linemod": {"title": "LINEMOD", "stand_in": False}, "ycb": {"title": "YCB", "stand_in": False}}
STAND_INS = {name: entry | {"stand_in": True} for name, entry in REAL.items()}
TITLES = {"gpca_paper": "GP-CA (paper)", "gpca": "GP-CA", "shap_additive": "SHAP", "shap_oracle": "SHAP (oracle)"}
EXPLAINERS = {name: {"title": title, "oracle": name == "shap_oracle", "sees": "pair"} for name, title in TITLES.items()}


def tidy(accuracies, test_samples=200):
    """Metrics from {(source, explainer, concept): accuracies over seeds}, by default 200 test samples, 50 of each."""
    records = []
    for (source, explainer, concept), values in accuracies.items():
        samples = test_samples if concept == "all" else 50
        for seed, value in enumerate(values):
            records.append(("attribution", source, explainer, "accuracy", concept, seed, value))
            records.append(("attribution", source, explainer, "test_samples", concept, seed, float(samples)))
    return pd.DataFrame(records, columns=list(TIDY_COLUMNS))


@pytest.fixture
def metrics():
    return tidy(
        {
            ("linemod", "gpca", "noise"): [0.99, 1.0, 1.0],
            ("linemod", "gpca", "pose"): [0.90, 0.92, 0.94],
            ("linemod", "gpca", "all"): [0.96, 0.97, 0.98],
            ("linemod", "shap_additive", "noise"): [0.4, 0.5, 0.3],
            ("linemod", "shap_additive", "all"): [0.29, 0.3, 0.31],
            ("ycb", "gpca", "all"): [0.94, 0.95, 0.96],
        }
    )


def test_table1_has_the_papers_explainers_with_predictions_in_its_order(metrics):
    markdown = table1_single_baselines(metrics, REAL, EXPLAINERS).markdown()
    assert "| Dataset | SHAP | GP-CA |" in markdown
    # s = 0.01, t_2 = 4.3027: ± 2.48 points; the dash stands where SHAP has no predictions.
    assert "| LINEMOD | 30.0 ± 2.5 | **97.0 ± 2.5** |" in markdown
    assert "| YCB | – | 95.0 ± 2.5 |" in markdown
    assert "Mean over 3 seeds, 200 test samples each" in markdown
    assert "95 % t-interval" in markdown
    assert "stand-in" not in markdown
    oracle = tidy({("ycb", "shap_oracle", "all"): [0.6, 0.7]})
    assert table1_single_baselines(pd.concat([metrics, oracle]), REAL, EXPLAINERS).markdown() == markdown


def test_table1_says_who_explains_fewer_samples(metrics):
    both = pd.concat([metrics, tidy({("ycb", "shap_additive", "all"): [0.3, 0.3, 0.4]}, test_samples=60)])
    both = both[(both["source"] == "ycb") | (both["method"] == "gpca")]
    footnotes = table1_single_baselines(both, REAL, EXPLAINERS).footnotes
    assert "60 to 200 test samples each" in footnotes[0]
    assert footnotes[1] == "Test samples explained: 200 by GP-CA; 60 by SHAP."


def test_table2_has_concepts_as_columns_and_only_gpca_as_rows(metrics):
    markdown = table2_per_concept(metrics, REAL, EXPLAINERS).markdown()
    assert "| Dataset | Explainer | Noise | Pose | All |" in markdown
    assert "| LINEMOD | GP-CA | **99.7 (92.3 to 100.0)** | 92.0 ± 5.0 | 97.0 ± 2.5 |" in markdown
    assert "SHAP" not in markdown


def test_stand_ins_are_said_in_title_and_row(metrics):
    for make in (table1_single_baselines, table1_extended, table2_per_concept):
        table = make(metrics, STAND_INS, EXPLAINERS)
        assert "on procedural stand-ins" in table.caption
        assert "LINEMOD (procedural stand-in)" in table.latex()
        mixed = make(metrics, STAND_INS | {"ycb": REAL["ycb"]}, EXPLAINERS)
        assert "partly on procedural stand-ins" in mixed.caption
        assert "| YCB |" in mixed.markdown()


def test_one_seed_has_no_interval():
    table = table1_single_baselines(tidy({("ycb", "gpca", "all"): [0.5]}), REAL, EXPLAINERS)
    assert "| YCB | 50.0 |" in table.markdown()
    assert "Mean over 1 seed, 200 test samples each" in table.markdown()
    assert table.records()[1] == ("ycb", "gpca", 50.0, "", "", 1, 200, False)


def test_a_share_near_its_limits_never_has_an_interval_of_no_width():
    metrics = tidy({("ycb", "gpca", "all"): [1.0, 1.0, 1.0], ("linemod", "gpca", "all"): [1.0, 1.0, 0.97]})
    clusters = [("attribution", "ycb", "gpca", "clusters", "all", seed, 4.0) for seed in range(3)]
    metrics = pd.concat([metrics, pd.DataFrame(clusters, columns=list(TIDY_COLUMNS))])
    table = table1_single_baselines(metrics, REAL, EXPLAINERS)
    low, _ = wilson_interval(12, 12)  # four clusters in three seeds
    assert f"| YCB | 100.0 ({100 * low:.1f} to 100.0) |" in table.markdown()
    assert "| LINEMOD | 99.0 (94.7 to 100.0) |" in table.markdown()  # that of the seeds is wider, and is cut
    assert table.footnotes[-1].startswith("In brackets")


def test_different_numbers_of_seeds_are_told():
    metrics = tidy({("ycb", "gpca", "all"): [0.5, 0.6], ("linemod", "gpca", "all"): [0.5, 0.6, 0.7]})
    assert "Mean over 2 to 3 seeds" in table1_single_baselines(metrics, REAL, EXPLAINERS).markdown()


def test_csv_is_machine_readable_and_bounds_stay_possible(metrics, tmp_path):
    table1_single_baselines(metrics, REAL, EXPLAINERS).write(tmp_path / "t")
    with (tmp_path / "t.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    gpca = next(row for row in rows if (row["source"], row["explainer"]) == ("linemod", "gpca"))
    assert float(gpca["mean"]) == 97.0
    assert float(gpca["ci_low"]) == pytest.approx(97 - 2.484138, abs=1e-6)
    assert float(gpca["ci_high"]) == pytest.approx(97 + 2.484138, abs=1e-6)
    assert (gpca["n_seeds"], gpca["n_test"]) == ("3", "600")
    assert len(rows) == 3
    assert (tmp_path / "t.md").read_text(encoding="utf-8").startswith("**Mean accuracy")


def test_the_page_is_given_the_words_of_the_table(metrics, tmp_path):
    table = table1_single_baselines(metrics, REAL, EXPLAINERS)
    table.write(tmp_path / "t")
    printed = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert (printed["caption"], printed["label_columns"], printed["footnotes"]) == (
        table.caption,
        1,
        [*table.footnotes],
    )
    assert printed["heads"][0] == "Dataset"
    [row, *_] = printed["rows"]
    bold = " | ".join(f"**{text}**" if best else text for text, best in row)
    assert f"| {bold} |" in table.markdown()


def test_ties_at_the_printed_precision_are_all_bold():
    cells = {(0, "a"): Cell(99.96, 0, 3, 1), (0, "b"): Cell(100.0, 0, 3, 1), (0, "c"): Cell(98, 0, 3, 1)}
    columns = {name: Column(name.upper()) for name in "abc"}
    table = Table("t", "T", {"source": "S"}, ((("x", "X"),),), "column", columns, cells)
    assert replace(table, compared=(list(cells),)).best() == {(0, "a"), (0, "b")}
    assert replace(table, compared=([(0, "b"), (0, "c")],)).best() == {(0, "b")}
    assert replace(table, compared=([(0, "c")], [(1, "a")], [(0, "a"), (1, "a")])).best() == set()


def test_a_best_that_most_of_a_large_group_share_is_not_bold():
    cells = {(row, "a"): Cell(0.0 if row < 7 else 1.0, 0, 3, 1) for row in range(12)}
    columns = {"a": Column("A", least_is_best=True)}
    rows = tuple((("x", str(row)),) for row in range(12))
    table = Table("t", "T", {"source": "S"}, rows, "column", columns, cells, compared=(list(cells),))
    assert table.best() == set()  # seven of twelve
    assert replace(table, compared=([key for key in cells if key[0] > 1],)).best() == {
        (row, "a") for row in range(2, 7)
    }


def test_latex_needs_no_letters_that_it_lacks_and_has_minus_signs():
    from gpca.reporting.tables.table import _tex

    words = _tex("ρ ± σ: -12.5 ± 3 (95 %), Matérn 3/2, k-means_2, point-to-plane, 5°, -- none")
    assert words.isascii()
    assert words == (
        r"$\rho$ $\pm$ $\sigma$: $-$12.5 $\pm$ 3 (95 \%), Mat\'ern 3/2, k-means\_2, point-to-plane, 5$^\circ$, -- none"
    )


def test_latex_is_balanced_and_escaped(metrics):
    sources = {"linemod": {"title": r"A_1 & 50 % ~ \x {b}", "stand_in": False}}
    latex = table1_single_baselines(metrics, sources, EXPLAINERS).latex()
    assert (
        r"A\_1 \& 50 \% \textasciitilde{} \textbackslash{}x \{b\} & 30.0 $\pm$ 2.5 & \textbf{97.0 $\pm$ 2.5} \\"
        in latex
    )
    for environment in ("table", "tabular"):
        assert latex.count(rf"\begin{{{environment}}}") == latex.count(rf"\end{{{environment}}}") == 1
    assert latex.count(r"\toprule") == latex.count(r"\midrule") == latex.count(r"\bottomrule") == 1
    assert latex.replace(r"\{", "").replace(r"\}", "").count("{") == latex.replace(r"\{", "").replace(r"\}", "").count(
        "}"
    )
    assert latex.isascii()
    rows = [line for line in latex.splitlines() if line.endswith(r"\\")]
    assert {line.replace(r"\&", "").count("&") for line in rows} == {2}


def test_latex_spans_both_columns_only_where_it_must(metrics):
    assert r"\begin{table}[t]" in table1_single_baselines(metrics, REAL, EXPLAINERS).latex()
    assert r"\begin{table*}[t]" in table1_single_baselines(metrics, STAND_INS, EXPLAINERS).latex()


def test_metrics_without_these_explainers_are_refused(metrics):
    unknown = {"sa_local_additive": {"title": "SA", "oracle": False, "sees": "runs"}}
    for make in (table1_single_baselines, table1_extended, table2_per_concept):
        with pytest.raises(InputError, match=make.__name__):
            make(metrics, REAL, unknown)


def test_column_text_rounds_and_shows_missing_intervals():
    assert Column("A").text(Cell(97.749, 0.449, 5, 1000)) == "97.7 ± 0.4"
    assert Column("A", decimals=2).text(Cell(97.749, math.nan, 1, 200)) == "97.75"
    assert Column("A", decimals=0, interval=False).text(Cell(400.0, 0.1, 5, 1000)) == "400"


def full(source, explainer, accuracies, **metrics):
    """Metrics of one explainer as the collectors make them, others than the accuracy the same over seeds."""
    given = {"permuted_accuracy": 0.9, "abstention_rate": 0.125, "icp_calls": 400.0, "seconds_per_sample": 0.25}
    given |= {"test_samples": 200.0, "causal_samples": 80.0, "causal_accuracy": 0.5} | metrics
    records = [
        ("attribution", source, explainer, metric, "all", seed, value)
        for seed, accuracy in enumerate(accuracies)
        for metric, value in (given | {"accuracy": accuracy}).items()
    ]
    return pd.DataFrame(records, columns=list(TIDY_COLUMNS))


@pytest.fixture
def everything():
    return pd.concat(
        [
            full("ycb", "gpca", [0.89, 0.9, 0.91], icp_calls=0.0, seconds_per_sample=0.0204),
            full("ycb", "shap_additive", [0.3, 0.4, 0.35], test_samples=60.0, causal_samples=21.0),
            full("ycb", "shap_oracle", [0.97, 0.97, 0.97]),
            full("linemod", "gpca", [0.79, 0.8, 0.81]),
        ]
    )


def test_extended_has_a_row_per_explainer_and_a_unit_per_column(everything):
    table = table1_extended(everything, REAL, EXPLAINERS)
    lines = table.markdown().splitlines()
    assert lines[2] == (
        "| Dataset | Explainer | Reads | Accuracy (%) | Relabeled (%) | Causal (%) | n causal "
        "| Abstained (%) | ICP calls | Seconds | n |"
    )
    constant = "90.0 (85.1 to 93.4) | 50.0 (39.3 to 60.7) | 80 | 12.5"
    assert lines[4] == f"| LINEMOD | GP-CA | pair | 80.0 ± 2.5 | {constant} | 400 | 0.250 | 200 |"
    assert lines[5] == f"| YCB | GP-CA | pair | **90.0 ± 2.5** | {constant} | 0 | 0.020 | 200 |"
    assert lines[6].startswith("| YCB | SHAP | pair | 35.0 ± 12.4 |")
    assert lines[6].endswith("| 21 | 12.5 | 400 | 0.250 | 60 |")
    assert "60 to 200 test samples each" in table.footnotes[0]
    assert "the one column that differs from run to run" in table.markdown()


def test_extended_sets_the_best_rival_in_bold_and_never_an_oracle(everything):
    table = table1_extended(everything, REAL, EXPLAINERS)
    assert table.best() == {(1, "accuracy")}
    assert [labels[1][1] for labels in table.rows if labels[0][0] == "ycb"] == ["GP-CA", "SHAP", "SHAP (oracle)"]
    assert "oracles apart" in table.markdown()
    rivals = {name: entry for name, entry in EXPLAINERS.items() if not entry["oracle"]}
    assert "oracle" not in table1_extended(everything, REAL, rivals).markdown()


def test_extended_csv_is_one_line_per_number(everything):
    records = table1_extended(everything, REAL, EXPLAINERS).records()
    heads = ("metric", "mean", "ci_low", "ci_high", "n_seeds", "n_test", "at_least")
    assert records[0] == ("source", "explainer", "reads", *heads)
    assert len(records) == 1 + 4 * 8
    assert ("ycb", "gpca", "pair", "seconds_per_sample", 0.0204, 0.0204, 0.0204, 3, 600, False) in records
    assert ("ycb", "shap_additive", "pair", "causal_accuracy", 50.0, 30.337916, 69.662084, 3, 63, False) in records
    assert ("ycb", "shap_additive", "pair", "accuracy", 35.0, 22.579311, 47.420689, 3, 180, False) in records
    assert ("ycb", "gpca", "pair", "icp_calls", 0.0, 0.0, 0.0, 3, 600, False) in records


def test_extended_leaves_out_what_was_not_measured(everything):
    accuracies = everything[~everything["metric"].str.startswith(("causal", "seconds"))]
    markdown = table1_extended(accuracies, REAL, EXPLAINERS).markdown()
    assert "Causal" not in markdown
    assert "Seconds" not in markdown


def test_a_table_that_may_be_wider_than_the_text_is_scaled_down_in_latex(everything):
    wide = table1_extended(everything, STAND_INS, EXPLAINERS).latex()
    assert r"\usepackage{booktabs, graphicx}" in wide.splitlines()[0]
    assert wide.count(r"\resizebox") == wide.count(r"\end{tabular}}") == 1
    assert wide.count("{") == wide.count("}")
    assert "resizebox" not in table1_single_baselines(everything, REAL, EXPLAINERS).latex()
