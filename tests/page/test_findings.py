"""What the page of a run opens with: sentences whose numbers are those of the run's files."""

import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import AGAINST, KEYS, NUMBERS
from gpca.page.findings import Titles, findings_of

TITLES = Titles(
    explainers={
        name: {"title": name.upper(), "oracle": name == "shap_oracle"}
        for name in ("gpca_paper", "shap_additive", "forest", "shap_oracle", "rule")
    },
    cause_explainers={"gpca": "GP-CA (aligned source)", "pair": "GP-CA on the pair", "rule": "Rule and gate"},
    budget=3,
)
RESULTS = (
    *("table1_single_baselines", "table1_extended", "table9_causes"),
    *("table6_backbones", "table3_active_learning", "table8_recovery"),
)


def write_metrics(path, rows, table="attribution", concept="all"):
    """Write (source, method, metric, value) of one seed as tidy metrics."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"{table},{source},{method},{metric},{concept},0,{value}" for source, method, metric, value in rows]
    path.write_text("\n".join(["table,source,method,metric,concept,seed,value", *lines, ""]))


@pytest.fixture
def folder(tmp_path):
    accuracies = {"gpca_paper": (0.97, 0.94), "shap_additive": (0.30, 0.30), "forest": (0.98, 0.99)}
    accuracies |= {"shap_oracle": (1, 1), "rule": (1, 0.99)}
    rows = [
        (source, method, "accuracy", value)
        for method, of_sources in accuracies.items()
        for source, value in zip(("a", "b"), of_sources, strict=True)
    ]
    rows += [(source, "gpca_paper", "test_samples", 50) for source in "ab"]
    rows += [("a", "gpca_paper", "causal_samples", 8), ("b", "gpca_paper", "causal_samples", 4)]
    write_metrics(tmp_path / "metrics.csv", rows)
    frames = [
        ("real_rgbd", method, "accuracy", value) for method, value in (("x-none", 0.5), ("y-pca", 0.8), ("z", 0.1))
    ]
    write_metrics(tmp_path / "real_world.csv", frames)
    recovered = [("recovery", name, "recovered_within_3", v) for name, v in (("gpca", 0.7), ("random", 0.4))]
    write_metrics(tmp_path / "recovery.csv", recovered, "recovery")
    labels = [
        ("a", strategy, metric, value)
        for strategy, values in (("bald_kmeans", (12, 1, 60)), ("random", (60, 0, 60)))
        for metric, value in zip(("labels_to_target", "reached", "labels"), values, strict=True)
    ]
    write_metrics(tmp_path / "active_learning.csv", labels, "active_learning/rare_5", "overlap")
    lines = []
    for method, value, gain in (
        ("ceiling", 0.9, ""),
        ("rule", 0.4, "chance,1,9,90,0.15,0.1,0.2"),
        ("gpca", 0.5, "rule,1,9,90,0.1,0.0,0.2"),
        ("pair", 0.7, "rule,1,9,90,0.3,0.2,0.4"),
    ):
        keys = f"causes,pooled,{method},balanced_accuracy,all"
        lines.append(f"{keys},,,1,9,90,{value},{value - 0.05},{value + 0.05}")
        lines += [f"{keys},trivial,{gain}"] if gain else []
    lines += [
        f"causes,pooled,{method},regret,all,,,1,9,60,{value},0.0,1.0"
        for method, value in (("rule", 0.6), ("pair", 0.25))
    ]
    head = ",".join((*KEYS, *AGAINST, *NUMBERS))
    (tmp_path / "cause_intervals.csv").write_text("\n".join([head, *lines, ""]))
    return tmp_path


def test_every_number_is_that_of_the_files(folder):
    said = {finding.number: finding.text for finding in findings_of(folder, TITLES, RESULTS)}
    assert list(said) == ["99 to 100 %", "94 to 97 %", "98.5 %", "12 %", "70 %", "25 %", "50 to 80 %", "12 labels"]
    assert "SHAP 30 %" in said["94 to 97 %"]
    for words in ("FOREST", "the 2 other explainers", "GPCA_PAPER has 95.5 %"):
        assert words in said["98.5 %"]
    assert "more than 60 labels" in said["12 labels"]


def test_findings_of_causes_and_of_recovery_stand_apart(folder):
    texts = [finding.text for finding in findings_of(folder, TITLES, ("table9_causes", "table8_recovery"))]
    assert len(texts) == 3
    for words in ("70 % (95 % interval 65 to 75 %): GP-CA on the pair", "GP-CA (aligned source) has 50 %", "90 %"):
        assert words in texts[0]
    assert "The best trivial rival, Rule and gate, is 30 points behind (20 to 40)." in texts[0]
    for words in ("25 % of the error", "GP-CA on the pair", "the untrained rule leaves 60 %"):
        assert words in texts[1]
    for words in ("70 % of the failed", "3 actions", "random actions 40 %"):
        assert words in texts[2]


def test_what_a_run_has_not_is_not_spoken_of_and_a_damaged_file_is_named(folder):
    assert findings_of(folder, TITLES, ()) == []
    for path in folder.glob("*.csv"):
        path.unlink()
    assert findings_of(folder, TITLES, RESULTS) == []
    (folder / "recovery.csv").write_text("table\n1\n")
    with pytest.raises(InputError, match=r"recovery\.csv: column"):
        findings_of(folder, TITLES, RESULTS)
