"""Times and findings that pages print are those of the reference, or of the page that has them all."""

import csv
import re

import pytest

from .documents import ROOT, unwrapped

PAPERS_TABLES = (  # and the eighth, which is ours
    *("table1_single_baselines", "table2_per_concept", "table3_active_learning", "table4_kernels"),
    *("table5_learners", "table6_backbones", "table7_runtime", "table8_recovery"),
)


@pytest.mark.parametrize(("run", "name"), [("embedded", "embedded default"), ("real", "real objects")])
def test_the_readme_has_the_times_of_the_page_of_all_targets(run, name):
    page = (ROOT / "docs/reproducing.md").read_text()
    block = page.split(f"<!-- times of results/{run} -->")[1].split(f"<!-- end of results/{run} -->")[0]
    rows = re.findall(r"^\| `tables/(\w+)\.md` \| \d+ \| [\d.]+ \| ([\d.]+) \|", block, re.MULTILINE)
    minutes = {table: f"{float(wall):.0f}" for table, wall in rows}
    [shown] = re.findall(rf"^\| {name} \| ([\d |]+) \|$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert shown.split(" | ") == [minutes[table] for table in PAPERS_TABLES]


FOUND = {"GP-CA on the pair": "gpca_pair", "inlier RMSE (gate)": "gate_rmse"}
FOUND |= {"GP-CA on the aligned source, the paper's input": "gpca"}
FOUND |= {"forest on distances and motion": "pair_forest", "truth from other starts (ceiling)": "ceiling"}


def of_all_sources(explainer):
    """The rows of Table IX, by their metric."""
    with (ROOT / "results/reference/real/tables/table9_causes.csv").open() as file:
        rows = list(csv.DictReader(file))
    return {row["metric"]: row for row in rows if (row["source"], row["explainer"]) == ("pooled", explainer)}


@pytest.mark.parametrize("title", FOUND)
def test_what_was_found_about_causes_stands_in_the_reference(title):
    of = of_all_sources(FOUND[title])
    [line] = re.findall(rf"^\| {re.escape(title)} \|(.*)\|$", (ROOT / "docs/causes.md").read_text(), re.MULTILINE)
    metrics = {"balanced_accuracy": 1, "dominant_accuracy": 1, "false_alarm_rate": 1, "auroc_failed": 3}
    expected = [f"{float(of[name]['mean']):.{digits}f}" if name in of else "–" for name, digits in metrics.items()]
    assert [cell.split(" ± ")[0].strip() for cell in line.split("|")] == expected


def test_what_the_readme_says_of_causes_stands_in_the_reference():
    readme = unwrapped("README.md")

    def of(explainer, metric, digits):
        return f"{float(of_all_sources(explainer)[metric]['mean']):.{digits}f}"

    balanced = {name: of(name, "balanced_accuracy", 0) for name in ("gpca", "gpca_pair", "pair_committee", "ceiling")}
    assert f"a balanced accuracy of {balanced['gpca']} % from the paper's input" in readme
    assert f"both clouds reaches {balanced['gpca_pair']} %; no method exceeds {balanced['pair_committee']} %" in readme
    assert f"the ceiling is {balanced['ceiling']} %" in readme
    area = {name: of(name, "auroc_failed", 3) for name in ("gpca_pair", "gate_rmse", "gate_fitness", "gate_spread")}
    assert f"with an AUROC of {area['gpca_pair']}. The inlier RMSE reaches {area['gate_rmse']}" in readme
    assert f"the best common gate, {area['gate_spread']}." in readme
    assert area["gate_spread"] == max(area[name] for name in area if name.startswith("gate"))


def test_what_was_found_under_controls_stands_in_the_reference():
    table = (ROOT / "results/reference/real/tables/table10_controls.md").read_text()
    page = (ROOT / "docs/controls.md").read_text().split("## What was found")[1]
    rows = re.findall(r"^\| ([^|\n]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", page, re.MULTILINE)
    assert len(rows) == 4
    for explainer, *shown in rows:
        [line] = re.findall(rf"^\| All together \| {re.escape(explainer)} \|(.*)$", table, re.MULTILINE)
        assert shown == [cell.replace("*", "").split()[0] for cell in line.split("|")[:4]]
