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
    cause_explainers={"gpca": "GP-CA (aligned source)", "pair": "GP-CA on the pair", "rule": "Rule and gate"}
    | {"reenact": "Re-enactment", "pair_committee": "Committee"},
    shifts={"scaled": "Model scaled"},
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


def write_intervals(path, rows, table="attribution"):
    """Write (source, method, metric, value) with bounds that lie 5 points beside it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"{table},{s},{method},{metric},all,2,9,90,{v},{v - 0.05},{v + 0.05}" for s, method, metric, v in rows]
    path.write_text("\n".join([",".join((*KEYS, *NUMBERS)), *lines, ""]))


@pytest.fixture
def folder(tmp_path):
    accuracies = {
        "gpca_paper": (0.94, 0.91),
        "shap_additive": (0.30, 0.30),
        "forest": (0.92, 0.93),
        "rule": (0.95, 0.94),
    }
    rows = [
        (source, method, "accuracy", value)
        for method, of_sources in accuracies.items()
        for source, value in zip(("a", "b"), of_sources, strict=True)
    ]
    write_intervals(tmp_path / "attribution_intervals.csv", rows)
    frames = [
        ("real_rgbd", name, "accuracy", value) for name, value in (("dgcnn-none", 0.5), ("rule", 0.8), ("z", 0.1))
    ]
    write_intervals(tmp_path / "real_world_intervals.csv", frames)
    shares = {"gpca": 0.7, "random": 0.4, "sequence_a_b": 0.8, "sequence_b_a": 0.6}
    recovered = [("recovery", name, "recovered_within_3", value) for name, value in shares.items()]
    write_intervals(tmp_path / "recovery_intervals.csv", recovered, "recovery")
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


def test_every_number_is_that_of_the_files_and_has_an_interval(folder):
    said = {finding.number: finding.text for finding in findings_of(folder, TITLES, RESULTS)}
    assert list(said) == ["94 to 95 %", "91 to 94 %", "70 %", "25 %", "50 %", "12 labels in 1 of 1 run"]
    assert "GPCA_PAPER names it in 91 to 94 % (86 to 99)" in said["91 to 94 %"]
    assert "SHAP in 30 % (25 to 35)" in said["91 to 94 %"]
    assert "DGCNN without reduction in 50 % (45 to 55); the untrained rule in 80 % (75 to 85)." in said["50 %"]
    assert "more than 60 labels in each of 1 run" in said["12 labels in 1 of 1 run"]


def test_findings_of_causes_and_of_recovery_stand_apart(folder):
    texts = [finding.text for finding in findings_of(folder, TITLES, ("table9_causes", "table8_recovery"))]
    assert len(texts) == 3
    for words in ("70 % (95 % interval 65 to 75 %): GP-CA on the pair", "GP-CA (aligned source) has 50 %", "90 %"):
        assert words in texts[0]
    assert "The best trivial rival, Rule and gate, is 30 points behind (20 to 40)." in texts[0]
    for words in ("25 % of the error", "(0 to 100; GP-CA on the pair)", "the untrained rule leaves 60 % (0 to 100)"):
        assert words in texts[1]
    for words in ("70 % (65 to 75) of the failed", "3 actions; random actions 40 % (35 to 45)", "in hindsight 80 %"):
        assert words in texts[2]


def test_what_a_run_has_not_is_not_spoken_of_and_a_damaged_file_is_named(folder):
    assert findings_of(folder, TITLES, ()) == []
    for path in folder.glob("*.csv"):
        path.unlink()
    assert findings_of(folder, TITLES, RESULTS) == []
    (folder / "recovery_intervals.csv").write_text("table\n1\n")
    with pytest.raises(InputError, match=r"recovery_intervals\.csv: column"):
        findings_of(folder, TITLES, RESULTS)


def difference(method, other, part, samples, clusters, value, low, high):
    keys = f"causes,pooled,{method},balanced_accuracy,{part}"
    return f"{keys},trained,{other},2,{clusters},{samples},{value},{low},{high}"


@pytest.mark.parametrize(
    ("samples", "clusters", "bounds", "said"),
    [
        (120, 9, (0.05, 0.15), "Re-enactment leads Committee"),
        (120, 9, (-0.15, -0.05), "Committee, the best explainer"),
        (120, 9, (-0.05, 0.15), "Re-enactment is not shown to lead Committee"),
        (40, 9, (0.05, 0.15), "Too little to conclude who leads: 13 samples of a kind and 9 families"),
        (120, 4, (0.05, 0.15), "Too little to conclude who leads: 40 samples of a kind and 4 families"),
    ],
)
def test_who_leads_is_said_first_a_rival_too_and_nothing_is_concluded_from_little(
    folder, samples, clusters, bounds, said
):
    head, *lines = (folder / "cause_intervals.csv").read_text().splitlines()
    for metric in ("false_alarm_rate", "dominant_accuracy"):
        lines.append(f"causes,pooled,reenact,{metric},all,,,2,{clusters},{samples},0.5,0.4,0.6")
    lines.append(difference("reenact", "pair_committee", "all", 240, clusters, sum(bounds) / 2, *bounds))
    (folder / "cause_intervals.csv").write_text("\n".join([head, *lines, ""]))
    first = findings_of(folder, TITLES, ("table9_causes",))[0].text
    assert first.startswith(said), first


def test_the_aim_under_shifts_is_said_to_be_missed_where_the_interval_contains_0(folder):
    rows = [difference("reenact", "pair_committee", part, 240, 9, 0.06, -0.01, 0.13) for part in ("mean", "scaled")]
    (folder / "shifts.csv").write_text("\n".join([",".join((*KEYS, *AGAINST, *NUMBERS)), *rows, ""]))
    [finding] = findings_of(folder, TITLES, ("table9_shift",))
    assert finding.number == "+6 points"
    assert "The aim is not reached, as the interval contains 0" in finding.text
