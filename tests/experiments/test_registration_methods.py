"""Registration methods from files of trials to Tables XI."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import COLUMNS, TIDY_COLUMNS, read_clustered, tidy
from gpca.experiments import registration_methods
from gpca.experiments.registration_methods import collect, share_of_milder, table11_registration
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.cells import rows_where
from gpca.steps.registration_trials import SEVERITY_COLUMNS
from tests.experiments.runs import YCB, run_with

ERROR_COLUMNS = ("add_relative", "rotation_error_rad", "translation_error")
RANGES = {"noise": [0.01, 0.03], "rotation_deg": [15, 60], "translation": [0.05, 0.30], "crop": [0.2, 0.6]}
CURVE = {"error": 0.03, "curve": [0.005, 0.03, 0.5]}
MILD = dict(zip(SEVERITY_COLUMNS, (0.011, 0.3, 0.06, 0.22), strict=True))
SEVERE = dict(zip(SEVERITY_COLUMNS, (0.029, 1.0, 0.29, 0.58), strict=True))


def of_run(**sections):
    return run_with(**{"success": CURVE, "registrations": {"severities": RANGES}} | sections)


def trial(sample, name, good, **entries):
    errors = dict(zip(ERROR_COLUMNS, (0.01, 0.1, 0.02) if good else (0.3, 1.1, 0.2), strict=True))
    known = {"sample": sample, "object": name, "concept": CONCEPTS[sample % 3], "start": "initial", "failure": ""}
    return known | {"points": 100} | MILD | errors | entries


def two_starts(starts=("initial", "fgr"), **changes):
    """Six pairs, two of each cause, the milder one a success from the first start."""
    records = []
    for sample in range(6):
        for start in starts:
            good = sample < 3 and start == starts[0]
            severities = MILD if sample < 3 else SEVERE
            entries = severities | {"start": start, "failure": "" if good else "lost, alas"}
            records.append(trial(sample, "cone", good, points=300 + 100 * (sample % 2), **entries))
    return pd.DataFrame(records).assign(**changes)


def of_objects(names, seed):
    """Each object has a pair of each cause; the first object's succeed, and of the others those of noise."""
    severe = dict.fromkeys(SEVERITY_COLUMNS, 0.02) | {"severity_rotation_rad": 1.0, "severity_crop": 0.55}
    records = []
    for sample in range(3 * len(names)):
        good = sample < 3 or sample % 3 == 0
        worse = {} if good else {"add_relative": 0.3 + 0.1 * seed}
        records.append(trial(sample, names[sample // 3], good, **severe, **worse))
    return pd.DataFrame(records)


@pytest.fixture
def object_files(tmp_path, objects):
    """Objects of two sources, of which two are of one family."""
    paths = [tmp_path / f"objects/{source}.npz" for source in ("ycb", "cups")]
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        families = np.array(["box", "round", "round"])
        dataclasses.replace(objects, families=families, folds=np.array([0, 1, 1])).save(path, path.stem)
    return paths


@pytest.fixture
def written(tmp_path):
    def write(rows, method="gicp", seed=0, source="ycb"):
        path = tmp_path / f"methods/{source}/{method}/seed{seed}.csv"
        write_csv(path, rows)
        return path

    return write


@pytest.fixture
def files(written, objects):
    """Two sources of two seeds each."""
    return [
        written(of_objects(objects.names, seed), "gicp", seed, source) for source in ("ycb", "cups") for seed in (0, 1)
    ]


def value(metrics, **wanted):
    [number] = rows_where(metrics, **wanted)["value"]
    return number


def test_every_start_cause_and_bin_has_its_metrics(written, object_files):
    metrics, _ = collect(of_run(), [written(two_starts(), seed=seed) for seed in (0, 1)], object_files)
    assert tuple(metrics.columns) == TIDY_COLUMNS
    assert set(metrics["method"]) == {"gicp", "fgr+gicp"}
    first = metrics[metrics["seed"] == 1]
    expected = {"success": 0.5, "failed": 0.5, "add": 0.155, "rotation_deg": np.rad2deg(0.6), "translation": 0.11}
    expected |= {"test_samples": 6, "points": 350}
    expected |= {"success_0.5": 0, "success_3": 0.5, "success_50": 0.5}  # a method that gave up has no success
    for metric, number in expected.items():
        assert value(first, method="gicp", concept="all", metric=metric) == pytest.approx(number)
    for concept in CONCEPTS:
        assert value(first, method="gicp", metric="test_samples", concept=concept) == 2
        assert value(first, method="gicp", metric="success", concept=f"{concept}_low") == 1
        assert value(first, method="gicp", metric="success", concept=f"{concept}_high") == 0
        assert value(first, method="fgr+gicp", metric="success", concept=concept) == 0
    assert not metrics["concept"].str.endswith("middle").any()  # no pair is of middle severity


def test_a_lead_is_paired_and_over_the_best_other_method_of_the_same_start(written, object_files):
    gicp = two_starts()
    worse = gicp.assign(add_relative=np.where(gicp["sample"] == 1, 0.3, gicp["add_relative"]))
    worst = gicp.assign(add_relative=0.3)
    trials = {"gicp": gicp, "huber": worse[worse["sample"] < 5], "tukey": worst}  # one pair was not registered by all
    files = [written(rows, method, seed) for seed in (0, 1) for method, rows in trials.items()]
    leads = collect(of_run(), files, object_files)[1].query("against == 'rival'").set_index(["method", "concept"])
    assert set(leads["source"]) == {"pooled"} and set(leads.loc[["gicp"], "samples"]) == {10, 4, 2}
    ahead = leads.loc["gicp", "all"]
    assert (ahead["other"], ahead["value"]) == ("huber", pytest.approx(1 / 5))
    assert leads.loc["huber", "all"]["value"] == pytest.approx(-1 / 5)
    assert leads.loc["fgr+gicp", "all"]["other"].startswith("fgr+")


def test_thirds_of_the_drawn_severities_have_a_third_of_the_draws_each():
    random, draws = np.random.default_rng(0), 30_000
    rows = pd.DataFrame(
        {
            "severity_noise": random.uniform(0.01, 0.03, draws),
            "severity_rotation_rad": np.deg2rad(random.uniform(15, 60, draws)),
            "severity_translation": random.uniform(0.05, 0.30, draws),
            "severity_crop": random.uniform(0.2, 0.6, draws),
        }
    )
    for concept in CONCEPTS:
        shares = share_of_milder(rows, concept, RANGES)
        np.testing.assert_allclose(np.histogram(shares, 3, (0, 1))[0] / draws, 1 / 3, atol=0.01)
    worst = pd.DataFrame({"severity_rotation_rad": [np.pi / 3, np.pi / 12], "severity_translation": [0.30, 0.05]})
    assert share_of_milder(worst, "pose", RANGES) == pytest.approx([1, 0])
    assert np.isfinite(share_of_milder(rows, "overlap", RANGES | {"crop": [0.3, 0.3]})).all()


def test_intervals_are_of_the_same_measures_over_all_pairs(files, object_files, tmp_path):
    metrics, found = collect(of_run(success={"error": 0.03, "curve": [0.03, 0.5]}), files, object_files)
    write_csv(tmp_path / "intervals.csv", found, form=None)
    found = read_clustered(tmp_path / "intervals.csv")
    assert (found["against"] == "").all()  # there is no other method
    found = found.set_index(["method", "metric", "concept"])
    metrics = metrics.set_index(["method", "metric", "concept"])["value"]
    counts = ("test_samples", "points")
    every = {key for key in metrics.index if key[1] not in counts and (key[1] == "success" or key[2] == "all")}
    assert every == set(found.index)  # the tables show no errors by cause
    for key in found.index:
        assert found.loc[key, "value"] == pytest.approx(metrics[key].mean())
    row = found.loc["gicp", "success", "all"]
    assert (row["seeds"], row["clusters"], row["samples"]) == (2, 4, 36)  # clusters: families of each source
    assert row["low"] < row["value"] < row["high"]
    always = found.loc["gicp", "success", "noise"]
    assert (always["value"], always["low"], always["high"]) == pytest.approx((1, *wilson_interval(8, 8)))
    turned = found.loc["gicp", "rotation_deg", "all"]
    assert turned["value"] == pytest.approx(np.rad2deg((5 * 0.1 + 4 * 1.1) / 9))
    assert 0 <= turned["low"] < turned["value"] < turned["high"] <= 180


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"object": "teapot"}, r"object 'teapot' is none of objects/ycb\.npz"),
        ({"add_relative": np.nan}, "column 'add_relative' contains values that are not finite numbers"),
        (None, "column 'object' is missing"),
    ],
)
def test_faults_are_one_line(files, object_files, changes, message):
    rows = pd.read_csv(files[0])
    write_csv(files[0], rows.drop(columns="object") if changes is None else rows.assign(**changes))
    with pytest.raises(InputError, match=message):
        collect(of_run(), files, object_files)


METHODS = dict.fromkeys(("gicp", "huber", "fgr"))
SUCCESS = {"gicp": 0.5, "huber": 0.7, "fgr": 0.2, "fgr+gicp": 0.6, "fgr+huber": 0.4}
PARTS = ("all", *CONCEPTS, *(f"{cause}_{severity}" for cause in CONCEPTS for severity in ("low", "high")))
ERRORS = {"failed": 0.1, "add": 0.05, "rotation_deg": 12.0, "translation": 0.03}
RUN = of_run(methods=METHODS)


@pytest.fixture
def intervals():
    rows = []
    for method, success in SUCCESS.items():
        values = {("success", part): success for part in PARTS}
        values |= {(metric, "all"): value for metric, value in ERRORS.items()} | {("success_10", "all"): 0.9}
        for (metric, part), value in values.items():
            samples = 120 if part == "all" else 40
            keys = ("registration_methods", "pooled", method, metric, part, 3, 5, samples)
            rows.append((*keys, value, 0.8 * value, 1.1 * value))
    return pd.DataFrame(rows, columns=[*COLUMNS])


@pytest.fixture
def seconds():
    """The slower source has a quarter of the pairs."""
    rows = [
        ("registration_methods", source, method, metric, "all", seed, value)
        for source, values in {"ycb": (30, 0.02), "cups": (10, 0.06)}.items()
        for method in SUCCESS
        for metric, value in zip(("test_samples", "seconds", "points"), (*values, 100 * values[1] * 1e2), strict=True)
        for seed in range(3)
    ]
    return tidy(rows, "seconds")


def test_starts_causes_and_severities_stand_apart_and_global_methods_have_no_start(intervals, seconds):
    table = table11_registration(RUN, intervals, seconds, seconds)
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [
        ("initial", "gicp"), ("initial", "huber"), ("none", "fgr"), ("fgr", "gicp"), ("fgr", "huber")
    ]  # fmt: skip
    assert [labels[0][1] for labels in table.rows[1:4]] == ["Initial pose", "None", "Fast global registration"]
    cell = table.cells[0, "success_all"]
    assert (cell.mean, cell.seeds, cell.test_samples) == (pytest.approx(50), 3, 120)
    assert cell.bounds == pytest.approx((40, 55))
    assert table.cells[3, "milliseconds"].mean == pytest.approx(30)
    assert table.cells[3, "points"].mean == pytest.approx(300)  # of the pairs of both sources
    assert table.cells[3, "rotation_deg"].mean == pytest.approx(12)
    assert table.cells[3, "translation"].bounds == pytest.approx((2.4, 3.3))
    assert {row for row, key in table.best() if key == "success_all"} == {1, 3}
    text = table.markdown()
    assert "Over 3 seeds, 40 test samples each; in brackets: the 95 % interval of a bootstrap over families" in text
    assert "| Initial pose | GICP | 50.0 (40.0 to 55.0) |" in text
    assert "noise_middle" not in table.columns
    assert (0, "noise_low") in table.cells and (0, "noise_middle") not in table.cells


def test_methods_left_out_and_stand_ins_are_named(intervals, seconds, monkeypatch):
    left_out = {"kiss_matcher": "kiss_matcher"}
    monkeypatch.setattr(registration_methods.registry, "left_out", lambda names: left_out if names == METHODS else {})
    table = table11_registration(RUN, intervals, seconds, seconds)
    fault = "Left out, as the package is not installed: KISS-Matcher needs the package kiss_matcher."
    assert fault in table.markdown()
    assert "partly on procedural stand-ins" in table.caption
    real = table11_registration(of_run(methods=METHODS, sources={"ycb": YCB}), intervals, seconds, seconds)
    assert real.cells[0, "milliseconds"].mean == pytest.approx(20)
    assert "stand-in" not in real.caption
    with pytest.raises(InputError, match="has nothing to show"):
        table11_registration(of_run(methods={"trimmed": None}), intervals, seconds, seconds)
