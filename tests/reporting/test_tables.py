import csv
import math

import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.metrics import COLUMNS
from gpca.reporting.table import Cell, Table
from gpca.reporting.tables import table1_single_baselines, table2_per_concept

REAL = {"linemod": {"title": "LINEMOD", "stand_in": False}, "ycb": {"title": "YCB", "stand_in": False}}
STAND_INS = {name: entry | {"stand_in": True} for name, entry in REAL.items()}
EXPLAINERS = {"shap_additive": "SHAP", "gpca_paper": "GP-CA (paper)", "gpca": "GP-CA"}


def tidy(accuracies):
    """Metrics from {(source, explainer, concept): accuracies over seeds}, 200 test samples, 50 of each concept."""
    records = []
    for (source, explainer, concept), values in accuracies.items():
        samples = 200 if concept == "all" else 50
        for seed, value in enumerate(values):
            records.append(("attribution", source, explainer, "accuracy", concept, seed, value))
            records.append(("attribution", source, explainer, "test_samples", concept, seed, float(samples)))
    return pd.DataFrame(records, columns=list(COLUMNS))


@pytest.fixture
def metrics():
    return tidy(
        {
            ("linemod", "gpca", "noise"): [0.99, 1.0, 1.0],
            ("linemod", "gpca", "pose"): [0.90, 0.92, 0.94],
            ("linemod", "gpca", "all"): [0.97, 0.98, 0.99],
            ("linemod", "shap_additive", "noise"): [0.4, 0.5, 0.3],
            ("linemod", "shap_additive", "all"): [0.3, 0.3, 0.3],
            ("ycb", "gpca", "all"): [1.0, 1.0, 0.97],
        }
    )


def test_table1_has_the_explainers_with_predictions_in_config_order(metrics):
    markdown = table1_single_baselines(metrics, REAL, EXPLAINERS).markdown()
    assert "| Dataset | SHAP | GP-CA |" in markdown
    # s = 0.01, t_2 = 4.3027: ± 2.48 points; the dash stands where SHAP has no predictions.
    assert "| LINEMOD | 30.0 ± 0.0 | **98.0 ± 2.5** |" in markdown
    assert "| YCB | – | 99.0 ± 4.3 |" in markdown
    assert "Mean over 3 seeds, 200 test samples each" in markdown
    assert "95 % t-interval" in markdown
    assert "stand-in" not in markdown


def test_table2_has_concepts_as_columns_and_only_gpca_as_rows(metrics):
    markdown = table2_per_concept(metrics, REAL, EXPLAINERS).markdown()
    assert "| Dataset | Explainer | Noise | Pose | All |" in markdown
    assert "| LINEMOD | GP-CA | **99.7 ± 1.4** | 92.0 ± 5.0 | 98.0 ± 2.5 |" in markdown
    assert "SHAP" not in markdown


def test_stand_ins_are_said_in_title_and_row(metrics):
    for make in (table1_single_baselines, table2_per_concept):
        table = make(metrics, STAND_INS, EXPLAINERS)
        assert "on procedural stand-ins" in table.caption
        assert "LINEMOD (procedural stand-in)" in table.latex()
        mixed = make(metrics, STAND_INS | {"ycb": REAL["ycb"]}, EXPLAINERS)
        assert "partly on procedural stand-ins" in mixed.caption
        assert "| YCB |" in mixed.markdown()


def test_one_seed_has_no_interval():
    table = table1_single_baselines(tidy({("ycb", "gpca", "all"): [0.5]}), REAL, EXPLAINERS)
    assert "50.0 ± –" in table.markdown()
    assert "Mean over 1 seed, 200 test samples each" in table.markdown()
    assert table.records()[1] == ("ycb", "gpca", 50.0, "", "", 1, 200)


def test_different_numbers_of_seeds_are_told():
    metrics = tidy({("ycb", "gpca", "all"): [0.5, 0.6], ("linemod", "gpca", "all"): [0.5, 0.6, 0.7]})
    assert "Mean over 2 to 3 seeds" in table1_single_baselines(metrics, REAL, EXPLAINERS).markdown()


def test_csv_is_machine_readable_and_bounds_stay_possible(metrics, tmp_path):
    paths = [tmp_path / f"t.{suffix}" for suffix in ("csv", "md", "tex")]
    table1_single_baselines(metrics, REAL, EXPLAINERS).write(*paths)
    with paths[0].open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    gpca = next(row for row in rows if (row["source"], row["explainer"]) == ("linemod", "gpca"))
    assert float(gpca["mean"]) == 98.0
    assert float(gpca["ci_low"]) == pytest.approx(98 - 2.484138, abs=1e-6)
    assert float(gpca["ci_high"]) == 100.0
    assert (gpca["n_seeds"], gpca["n_test"]) == ("3", "600")
    assert len(rows) == 3
    assert paths[1].read_text(encoding="utf-8").startswith("**Mean accuracy")


def test_ties_at_the_printed_precision_are_all_bold():
    cells = {(0, "a"): Cell(99.96, 0, 3, 1), (0, "b"): Cell(100.0, 0, 3, 1), (0, "c"): Cell(98, 0, 3, 1)}
    columns = {"a": "A", "b": "B", "c": "C"}
    table = Table("t", "T", {"source": "S"}, ((("x", "X"),),), "column", columns, cells)
    assert table.best(0) == {"a", "b"}
    alone = Table("t", "T", {"source": "S"}, ((("x", "X"),),), "column", {"c": "C"}, cells)
    assert alone.best(0) == set()


def test_latex_is_balanced_and_escaped(metrics):
    sources = {"linemod": {"title": r"A_1 & 50 % ~ \x {b}", "stand_in": False}}
    latex = table1_single_baselines(metrics, sources, EXPLAINERS).latex()
    assert (
        r"A\_1 \& 50 \% \textasciitilde{} \textbackslash{}x \{b\} & 30.0 $\pm$ 0.0 & \textbf{98.0 $\pm$ 2.5} \\"
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
    with pytest.raises(InputError, match="table1_single_baselines"):
        table1_single_baselines(metrics, REAL, {"sa_local_additive": "SA"})
    with pytest.raises(InputError, match="table2_per_concept"):
        table2_per_concept(metrics, REAL, {"shap_additive": "SHAP"})


def test_cell_text_rounds_and_shows_missing_intervals():
    assert Cell(97.749, 0.449, 5, 1000).text(1) == "97.7 ± 0.4"
    assert Cell(97.749, math.nan, 1, 200).text(2) == "97.75 ± –"
