"""A run against its reference: what agrees, what differs, what is missing, and which reference is of no use."""

import json
import shutil

import pandas as pd
import pytest
import yaml

from gpca.comparison import reference
from gpca.comparison.reference import KINDS, Allowance, check_reference, kind_of, read_means
from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS as TIDY
from gpca.process.code_files import ROOT
from gpca.process.processor import describe
from tests.steps.by_words import main

from .conftest import HEADS, SETTINGS, write


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def outcomes(folders, **more):
    settings = SETTINGS | more
    return {o.file: o for o in check_reference(*folders, Allowance(**settings))}


def check(folders, *more):
    return main(["check-reference", str(folders[0]), *more])


def test_the_same_numbers_are_identical(folders, capsys):
    assert check(folders) == 0
    out = capsys.readouterr().out
    assert "metrics.csv        identical  all 4 values\n" in out
    assert "tables/table1.csv  identical  all 2 values\n" in out
    assert out.endswith(": 2 identical, 0 rounding, 0 different, 0 missing\n")


KERNELS = [("kernels", "ycb", "rbf", "accuracy", "all", seed, 0.5) for seed in (0, 1)]
ELBO = [("k", "ycb", "rbf", "elbo", "all", seed, seed) for seed in (0, 1)]
LABELS = [("a", "ycb", "random", "labels_to_target", "all", 0, 100)]
ACCURACY, TABLE = "gpca,accuracy,all,0,0.9\n", "tables/table1.csv"


@pytest.mark.parametrize(
    ("file", "rows", "old", "new", "settings", "verdict"),
    [
        # Of 200 samples 4 √(0.05 · 200) = 12.6 may be decided otherwise in balance: a mean by 0.0632.
        ("metrics.csv", (), ACCURACY, "gpca,accuracy,all,0,1.0\n", {}, "rounding"),
        ("metrics.csv", (), ACCURACY, "gpca,accuracy,all,0,0.77\n", {}, "different"),
        ("metrics.csv", (), "noise,all,0,50\n", "noise,all,0,62\n", {}, "rounding"),  # 12 of 200 samples
        ("metrics.csv", (), "noise,all,0,50\n", "noise,all,0,63\n", {}, "different"),
        ("metrics.csv", (), "b,accuracy,all,0,0.8\n", "b,accuracy,all,0,0.5\n", {}, "different"),  # within two seeds'
        # A file that counts no samples has those of its source.
        ("kernels.csv", KERNELS, "all,0,0.5", "all,0,0.62", {}, "rounding"),
        ("kernels.csv", KERNELS, "all,0,0.5", "all,0,0.62", {"deviations": 0}, "different"),
        ("kernels.csv", KERNELS, "all,0,0.5", "all,0,0.62", {"flipped": 0}, "different"),
        # What is no share of samples may differ by the reference's interval, and counts by a ratio.
        ("kernels.csv", ELBO, "all,0,0", "all,0,6", {}, "rounding"),
        ("kernels.csv", ELBO, "all,0,0", "all,0,6", {"half_widths": 0}, "different"),
        ("active_learning.csv", LABELS, "all,0,100", "all,0,124", {}, "rounding"),
        ("active_learning.csv", LABELS, "all,0,100", "all,0,124", {"ratio": 0.2}, "different"),
        # A table has its samples in a column.
        (TABLE, (), "gpca,90.0", "gpca,98.9", {}, "rounding"),
        (TABLE, (), "gpca,90.0", "gpca,99.1", {}, "different"),
    ],
)
def test_what_rounding_explains(folders, capsys, file, rows, old, new, settings, verdict):
    for folder in folders if rows else ():
        write(folder / file, TIDY, rows)
    change(folders[0] / file, old, new)
    outcome = outcomes(folders, **settings)[file]
    assert outcome.verdict == verdict
    if (rows, verdict) == (KERNELS, "rounding"):
        assert "(12 of 200 samples, where 13 are expected at most)" in outcome.detail
    if not settings:
        assert check(folders) == (verdict == "different")
        out = capsys.readouterr().out
        assert f"1 of {4 if file == 'metrics.csv' else 2 if file == TABLE else 1} values differ" in out
        cpu = "".join(f"{name} {describe()[name]}, " for name in ("family", "model") if describe()[name])
        cpu += describe()["instructions"]
        assert out.endswith(f"\nreference: A processor, {cpu}\nrun: A processor, {cpu}\n") or file != "metrics.csv"


def test_without_samples_the_tolerance_of_the_kind_holds(folders):
    for folder in (*folders, *folders):  # both seeds
        change(folder / "metrics.csv", "gpca,test_samples", "gpca,samples")
    change(folders[0] / "metrics.csv", ACCURACY, "gpca,accuracy,all,0,0.919\n")
    assert outcomes(folders)["metrics.csv"].verdict == "rounding"  # the mean by 0.0095, 0.01 is allowed
    change(folders[0] / "metrics.csv", "0.919\n", "0.921\n")
    assert outcomes(folders)["metrics.csv"].verdict == "different"


def test_one_of_many_values_is_enough_and_is_named(folders):
    """As when 31 of 180 samples were called rounding, in a file of which all else agreed."""
    for folder, more in zip(folders, (0.2, 0.0), strict=True):
        rows = [("kernels", "ycb", f"rbf{i}", "accuracy", "all", seed, 0.5 + seed / 10 + more * (i == 7))
                for i in range(400) for seed in (0, 1)]  # fmt: skip
        write(folder / "kernels.csv", TIDY, rows)
    outcome = outcomes(folders)["kernels.csv"]
    assert outcome.verdict == "different"
    assert outcome.detail.startswith(
        "1 of 400 values differ, 1 by more than rounding explains; the worst, kernels / ycb / rbf7"
    )


def test_the_largest_difference_is_measured_by_what_is_allowed(folders):
    change(folders[0] / "metrics.csv", ACCURACY, "gpca,accuracy,all,0,0.76\n")
    change(folders[0] / "metrics.csv", "noise,all,0,50\n", "noise,all,0,52\n")
    assert outcomes(folders)["metrics.csv"].detail == (
        "2 of 4 values differ, 1 by more than rounding explains; the worst, "
        "attribution / ycb / gpca / accuracy / all: -0.07, where 0.06325 is allowed "
        "(14 of 200 samples, where 13 are expected at most)"
    )


def test_times_are_not_compared(folders):
    change(folders[0] / "timings.csv", "1.0", "99.0")
    change(folders[0] / "comparison.csv", "YCB", "LINEMOD")
    row = "attribution,ycb,gpca,seconds_per_sample,all,0,{}\n"
    for folder, seconds in zip(folders, (1, 99), strict=True):
        with (folder / "metrics.csv").open("a") as file:
            file.write(row.format(seconds))
    assert {o.verdict for o in outcomes(folders).values()} == {"identical"}
    assert set(outcomes(folders)) == {"metrics.csv", "tables/table1.csv"}


@pytest.mark.parametrize(
    ("folder", "told"), [(0, "lacks 1 of 2 values, such as ycb / b"), (1, "adds to the reference 1 of 2")]
)
def test_other_rows_are_different(folders, folder, told):
    path = folders[folder] / "tables/table1.csv"
    path.write_text("".join(line for line in path.read_text().splitlines(keepends=True) if "ycb,b" not in line))
    outcome = outcomes(folders)["tables/table1.csv"]
    assert outcome.verdict == "different"
    assert told in outcome.detail


def test_what_is_missing_comes_with_the_command_that_makes_it(folders, capsys):
    (folders[0] / "metrics.csv").unlink()
    assert check(folders) == 1
    captured = capsys.readouterr()
    assert "metrics.csv        missing\n" in captured.out
    assert captured.err == f"1 missing; make them with: snakemake -j2 {folders[0]}/metrics.csv\n"
    here = folders[0].rename(folders[0].with_name("full"))
    (here / "tables/table1.csv").unlink()
    assert check([here], "--reference", str(folders[1])) == 1
    assert capsys.readouterr().err.endswith(
        f"snakemake -j2 {here}/metrics.csv {here}/tables/table1.csv --configfile config/full.yaml\n"
    )


def one_line(capsys):
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def test_values_that_differ_under_another_config_are_not_called_rounding(folders):
    here, there = (folder / "metrics.csv.provenance.json" for folder in folders)
    original = there.read_text()
    change(there, "c0ffee", "tea")
    assert outcomes(folders)["metrics.csv"].verdict == "identical"  # whatever made the same values
    change(folders[0] / "metrics.csv", ACCURACY, "gpca,accuracy,all,0,0.99\n")
    outcome = outcomes(folders)["metrics.csv"]
    assert outcome.verdict == "different"
    assert outcome.detail.endswith("; config differs in seeds")
    there.write_text(original)
    assert outcomes(folders)["metrics.csv"].verdict == "rounding"
    change(here, '"seeds"', '"causes": "tea", "seeds"')  # a section that is newer than the reference
    assert outcomes(folders)["metrics.csv"].verdict == "rounding"
    change(here, '"seeds": "c0ffee"', '"others": "c0ffee"')
    assert outcomes(folders)["metrics.csv"].verdict == "different"
    here.unlink()
    assert outcomes(folders)["metrics.csv"].verdict == "rounding"


HEAD, TABLE_HEAD = ",".join(TIDY) + "\n", ",".join(HEADS) + "\n"


@pytest.mark.parametrize(
    ("broken", "content", "message"),
    [
        ("metrics.csv", "attribution\n1\n", "is neither tidy metrics nor a table; regenerate it"),
        ("metrics.csv", HEAD + "a,ycb,gpca,accuracy,all,0,nan\n", "'value' is 'nan', not a finite number; regenerate"),
        ("metrics.csv", HEAD + "a,ycb,gpca,accuracy,all,0,0.9,0.8\n", "has rows with more entries than columns"),
        ("metrics.csv", HEAD + "a,ycb,gpca\n", "'value' is '', not a finite number"),
        ("metrics.csv", HEAD + 2 * "a,ycb,gpca,accuracy,all,0,0.9\n", "has a quantity of a seed twice"),
        ("metrics.csv", HEAD + "a,ycb,gpca,test_samples,all,0,-5\n", "'test_samples' is negative"),
        (TABLE, TABLE_HEAD + "ycb,gpca,,,,5,100,False\n", "has no mean at all"),
        (TABLE, TABLE_HEAD + "ycb,gpca,1,1,2,5,-100,False\n", "counts fewer than no samples or seeds"),
        ("metrics.csv.provenance.json", '{"config_sha256": [1]}', "'config_sha256' is no dict; make metrics.csv again"),
        ("metrics.csv.provenance.json", '{"device": ', "is not a provenance record"),
    ],
)
def test_a_broken_file_is_named(folders, capsys, broken, content, message):
    (folders[0] / broken).write_text(content)
    assert check(folders) == 2
    line = one_line(capsys)
    assert str(folders[0] / broken) in line
    assert message in line


def test_an_empty_mean_is_no_number_and_a_row_that_is_there_twice_is_another(folders):
    row = "ycb,gpca,1,1,2,5,100,False\n"
    for folder, rows in zip(folders, (row.replace(",1,1,2", ",,,") + row.replace("ycb", "b"), row + row), strict=True):
        (folder / TABLE).write_text(TABLE_HEAD + rows)
    assert outcomes(folders)[TABLE].verdict == "different"
    (folders[0] / TABLE).write_text(TABLE_HEAD + row.replace(",1,1,2", ",,,") + row)
    assert outcomes(folders)[TABLE].verdict == "different"


def test_no_run_and_no_reference(folders, capsys):
    assert main(["check-reference", str(folders[0].with_name("nix"))]) == 2
    assert "nix: no such folder; make it with 'snakemake -j2 all'" in one_line(capsys)
    shutil.rmtree(folders[1])
    assert check(folders) == 2
    assert "tiny: has no reference" in one_line(capsys)


def test_settings_replace_the_configs(folders, capsys):
    change(folders[0] / "metrics.csv", ACCURACY, "gpca,accuracy,all,0,1.0\n")
    tolerances = json.dumps({"tolerances": SETTINGS["tolerances"] | {"share": 0.06}})
    assert check(folders, "--settings", tolerances) == 0
    assert check(folders, "--settings", '{"tolerances": {"shares": 1}}') == 2
    assert "setting tolerances.shares: unknown; did you mean share?" in one_line(capsys)
    assert check(folders, "--settings", '{"tolerances": {}}') == 2
    assert "setting tolerances.correlation: is missing" in one_line(capsys)


def test_the_config_is_that_of_the_working_directory_or_the_one_named(folders, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert check(folders) == 2
    assert "config/config.yaml: no such file; run this in the folder of the suite, or name" in one_line(capsys)
    assert check(folders, "--config", str(ROOT / "config/config.yaml")) == 0
    (tmp_path / "config").mkdir()
    (tmp_path / "config/config.yaml").write_text(yaml.safe_dump({"reference": SETTINGS}))
    assert check(folders) == 0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("seeds: [0]", "has no section 'reference'"),
        ("reference: {tolerances: {}}", "setting tolerances.correlation: is missing"),
    ],
)
def test_a_config_that_does_not_say_what_agrees_is_named(folders, capsys, tmp_path, content, message):
    (tmp_path / "own.yaml").write_text(content)
    assert check(folders, "--config", str(tmp_path / "own.yaml")) == 2
    line = one_line(capsys)
    assert f"{tmp_path}/own.yaml: " in line
    assert message in line


@pytest.mark.parametrize(
    ("kind", "places"),
    {
        "share": "metrics:accuracy recovery:recovered_within_3 estimators:coverage_starts registration_methods:add "
        "tables/table12_failures:lead tables/table9_causes:nominal_calibration "
        "tables/table5_learners:ece tables/table5_shift:ece_severity",
        "count": "metrics:predicted_as_pose active_learning:labels_to_target recovery:tries",
        "correlation": "diagnostics:rho_max_score_knn_analytical_low tables/table12_failures:spearman_error "
        "tables/table5_learners:rho",
        "nats": "diagnostics:nll kernels:elbo estimators:kl_rotation_data estimators:nees_truth",
        "percent": "tables/table12_uncertainty:coverage tables/table11_registration:pose_low "
        "tables/table1_single_baselines:gpca_paper",
        "degrees": "registration_methods:rotation_deg tables/table11_registration:rotation_deg",
    }.items(),
)
def test_every_quantity_is_of_a_kind(kind, places):
    for place in places.split():
        file, quantity = place.split(":")
        assert kind_of(f"{file}.csv", quantity) == kind, place
    assert {of for *_, of in KINDS} == set(SETTINGS["tolerances"])


def test_the_kept_reference_can_be_read():
    folders = [path for path in (ROOT / "results/reference").iterdir() if path.is_dir()]
    files = [(path, str(path.relative_to(folder))) for folder in folders for path in folder.rglob("*.csv")]
    assert {folder.name for folder in folders} >= {"default", "full"} and len(files) >= 8
    for path in (path for path, name in files if name not in reference.NOT_COMPARED):
        assert len(read_means(path)) > 5
        rows = pd.read_csv(path, low_memory=False)
        for value, low, high in (("mean", "ci_low", "ci_high"), ("value", "low", "high")):
            if {value, low, high} <= set(rows):
                of = rows[[low, value, high]].apply(pd.to_numeric, errors="coerce").dropna()
                assert ((of[low] <= of[value] + 1e-9) & (of[value] <= of[high] + 1e-9)).all(), path
    with pytest.raises(InputError, match="neither tidy"):
        read_means(ROOT / "gpca/comparison/reasons.csv")


def test_a_share_of_the_runs_is_one_of_as_many_as_there_are_seeds(tmp_path):
    head = "table,source,method,metric,concept,seed,value\n"
    rows = [f"active_learning/pretrained,ycb,random,{name},noise,{seed},1.0\n" for name in ("reached", "accuracy")
            for seed in (0, 1, 2)]  # fmt: skip
    (tmp_path / "active_learning.csv").write_text(head + "".join(rows))
    found = {mean.quantity: mean.samples for mean in read_means(tmp_path / "active_learning.csv", {"ycb": 90}).values()}
    assert found == {"reached": 3, "accuracy": 90}
    table = read_means(ROOT / "results/reference/full/tables/table3_extended.csv")
    assert {mean.samples for mean in table.values() if mean.quantity == "reached"} == {5}
