"""Successes and errors of registration methods with intervals over families of objects."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from gpca.experiments.registration_methods.intervals import collect_intervals

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import read_clustered
from gpca.experiments.registration_methods import MEASURED, collect_trials
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.registration_trials import SEVERITY_COLUMNS

SUCCESS = {"error": 0.03, "curve": [0.03, 0.5]}
RANGES = {"noise": [0.01, 0.03], "rotation_deg": [15, 60], "translation": [0.05, 0.30], "crop": [0.2, 0.6]}
FAMILIES = ("box", "round", "round")


def trials(names, seed):
    """Each object has a pair of each cause; the first object's succeed, and of the others those of noise."""
    records = []
    for sample, (name, concept) in enumerate((name, concept) for name in names for concept in CONCEPTS):
        good = name == names[0] or concept == "noise"
        errors = dict(zip(MEASURED, (0.01, 0.1, 0.02) if good else (0.3 + 0.1 * seed, 1.1, 0.2), strict=True))
        severe = dict.fromkeys(SEVERITY_COLUMNS, 0.02) | {"severity_rotation_rad": 1.0, "severity_crop": 0.55}
        known = {"sample": sample, "object": name, "concept": concept, "start": "initial", "failure": ""}
        known |= {"points": 100}
        records.append(known | severe | errors)
    return pd.DataFrame(records)


@pytest.fixture
def files(tmp_path, objects):
    """Two sources of two seeds each, and their objects, of which two are of one family."""
    paths, of_objects = [], []
    for source in ("ycb", "cups"):
        of_objects.append(tmp_path / f"objects/{source}.npz")
        of_objects[-1].parent.mkdir(exist_ok=True)
        dataclasses.replace(objects, families=FAMILIES, folds=(0, 1, 1)).save(of_objects[-1], source)
        for seed in range(2):
            paths.append(tmp_path / f"methods/{source}/gicp/seed{seed}.csv")
            write_csv(paths[-1], trials(objects.names, seed))
    return paths, of_objects


@pytest.fixture
def found(files, tmp_path):
    write_csv(tmp_path / "intervals.csv", collect_intervals(*files, RANGES, SUCCESS), form=None)
    return read_clustered(tmp_path / "intervals.csv").set_index(["method", "metric", "concept"])


def test_values_are_those_of_the_metrics_over_all_pairs(files, found):
    metrics = collect_trials(files[0], RANGES, SUCCESS).set_index(["method", "metric", "concept"])["value"]
    counts = ("test_samples", "points")
    every = {key for key in metrics.index if key[1] not in counts and (key[1] == "success" or key[2] == "all")}
    assert every == set(found.index)  # the tables show no errors by cause
    for key in found.index:
        assert found.loc[key, "value"] == pytest.approx(metrics[key].mean())
    assert found.loc[("gicp", "success", "all"), "samples"] == 36


def test_clusters_are_the_families_of_each_source(found):
    row = found.loc["gicp", "success", "all"]
    assert (row["seeds"], row["clusters"]) == (2, 4)
    assert row["low"] < row["value"] < row["high"]
    always = found.loc["gicp", "success", "noise"]
    assert (always["value"], always["low"], always["high"]) == pytest.approx((1, *wilson_interval(8, 8)))
    turned = found.loc["gicp", "rotation_deg", "all"]
    assert turned["value"] == pytest.approx(np.rad2deg((5 * 0.1 + 4 * 1.1) / 9))
    assert 0 <= turned["low"] < turned["value"] < turned["high"] <= 180


def test_faults_are_one_line(files, tmp_path):
    paths, of_objects = files
    with pytest.raises(InputError, match="no files were given"):
        collect_intervals([], of_objects, RANGES, SUCCESS)
    rows = pd.read_csv(paths[0])
    write_csv(paths[0], rows.assign(object="teapot"))
    with pytest.raises(InputError, match=r"object 'teapot' is none of objects/ycb\.npz"):
        collect_intervals(*files, RANGES, SUCCESS)
    write_csv(paths[0], rows.drop(columns="object"))
    with pytest.raises(InputError, match="column 'object' is missing"):
        collect_intervals(*files, RANGES, SUCCESS)
