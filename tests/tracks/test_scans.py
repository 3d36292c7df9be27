"""The track of scans: two data sets of a run, one of which needs data that not everyone has."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import gpca
from gpca.__main__ import main
from gpca.attribution.predictions import prediction_frame
from gpca.causes.dataset import LABELS
from gpca.classifier.scores import Attribution
from gpca.config.check import check, with_success
from gpca.config.layers import without_false
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.experiments import scan_causes
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.steps.scan_causes import measure
from gpca.tracks import published as module
from gpca.tracks import scoring
from gpca.tracks.leaderboard import MARK
from gpca.tracks.published import Published
from gpca.tracks.samples import recipe_of
from gpca.tracks.scoring import score
from gpca.tracks.shipping import collect
from gpca.tracks.track import TRACKS

from ..config.configs import load
from ..steps.test_guarantee import write_measurements
from .conftest import knowing_scores

EVERYWHERE, RARE, SEED = "virtual_scans", "threedmatch", 100
TRACK = TRACKS["scans"]


@pytest.fixture(scope="session")
def full():
    """The config of the track, of one seed."""
    whole = load("full") | {"seeds": [SEED]}
    check(whole)
    return with_success(without_false(whole))


@pytest.fixture(scope="session")
def folder(causes, full, tmp_path_factory):
    """A run: made-up measurements of scans and objects, and what two methods said; every fourth has noise added."""
    folder, random, said = tmp_path_factory.mktemp("run"), np.random.default_rng(0), []
    tested = causes.subset(causes.rows("test"))
    n = len(tested)
    scenes = np.resize(["hall", "kitchen", "attic"], n)
    tested = replace(tested, registrations=replace(tested.registrations, cluster=scenes))
    pose_n_4 = np.tile([0.1, 0.1, 0.7, 0.1], (n, 1))
    for name in (EVERYWHERE, RARE):
        write_measurements(folder, tested, (name, SEED), random)
        for kind in ("causes", "descriptors", "reenactments"):
            (target := folder / f"scan_{kind}/{name}").mkdir(parents=True)
            (folder / f"{kind}/{name}/seed{SEED}.npz").rename(target / f"seed{SEED}.npz")
        told = {"sample": tested.registrations.sample, "cluster": scenes, "overlap": 0.5, "missed": False}
        told |= {"start": np.resize(["ladder", "global"], n), "times": np.resize([0.0, 0.0, 0.0, 2.0], n)}
        told |= {"stands_for": 1.0, "dominant_one_sided": "pose"}
        write_csv(folder / f"scan_causes/{name}/seed{SEED}.csv", pd.DataFrame(told))
        for (learned, explainer), scores in {
            ("scans", "chance"): pose_n_4,
            ("scans", "rule"): knowing_scores(tested),
            ("objects", "residuals"): pose_n_4,
        }.items():
            frame = prediction_frame(tested.registrations, Attribution.of_scores(LABELS, scores, seconds=0.0))
            said.append(frame.assign(scans=name, learned=learned, explainer=explainer))
    write_csv(folder / f"scan_diagnoses/seed{SEED}.csv", pd.concat(said))
    for source in full["sources"]:
        write_measurements(folder, causes, (source, SEED), random)
    return folder


@pytest.fixture(scope="session")
def shipped(folder, full):
    return collect(TRACK, folder, full)


@pytest.fixture
def published(shipped, tmp_path, monkeypatch):
    """What is shipped, where the commands find it."""
    monkeypatch.setattr(module, "FOLDER", tmp_path / "published")
    shipped.save(tmp_path / "published/scans.npz")
    return Published.load(TRACK)


def test_what_is_shipped_is_of_the_data_sets_of_the_run_and_says_where_methods_learned(shipped, causes):
    n = len(causes.rows("test"))
    assert [(source, len(rows)) for source, _, rows in shipped.rows.parts()] == [(EVERYWHERE, n), (RARE, n)]
    assert shipped.rows.counted.tolist() == [True, True, True, False] * (n // 2)
    assert [method.name for method in shipped.methods] == ["chance", "rule", "residuals (from objects)"]
    assert shipped.methods[2].title.endswith(" (from objects)")
    kinds = {file.split("/")[0] for file in shipped.hashes}
    assert kinds == {"scan_causes", "scan_descriptors", "scan_reenactments"}


def test_published_rows_have_the_numbers_of_table_18(shipped, folder, monkeypatch):
    monkeypatch.setattr(scan_causes, "FEWEST_OF_A_CAUSE", 1)
    scores, _ = score(shipped, {})
    files = [folder / f"scan_causes/{name}/seed{SEED}.npz" for name in (EVERYWHERE, RARE)]
    tables = [path.with_suffix(".csv") for path in files]
    run = Run({"scans": {"strata": (0.1, 1.0)}})
    wanted = scan_causes.collect(run, files, tables, [folder / f"scan_diagnoses/seed{SEED}.csv"])
    wanted = wanted[(wanted["condition"] == "natural") & (wanted["method"] != "truth") & (wanted["stratum"] == "all")]
    assert set(wanted["source"]) == {"pooled", EVERYWHERE, RARE} and "cause_accuracy" in set(wanted["metric"])
    own = scores.set_index(["group", "method", "metric"])
    for row in wanted.to_dict("records"):
        name = row["method"] + (" (from objects)" if row["learned"] == "objects" else "")
        found = own.loc[(row["source"], name, row["metric"])]
        for column in ("value", "low", "high"):
            assert found[column] == pytest.approx(row[column], nan_ok=True), (row["metric"], column)
    assert scan_causes.CAUSES in scoring.SHARES_OF_SAMPLES


def test_a_method_in_a_file_stands_among_the_published_rows_of_every_data_set(method, published, folder, capsys):
    assert main(["bench", "scans", method, "--samples", str(folder), "--out", "said.csv"]) == 0
    shown = capsys.readouterr().out
    assert len(re.findall(f"{MARK}RMSE below its median", shown)) == 3
    assert all(f"{name} (" in shown for name in ("All together", EVERYWHERE, RARE))
    assert "Minus RMSE below its median" in shown and "(points)" not in shown and " alone." not in shown
    assert main(["score", "scans", "said.csv"]) == 0
    again = capsys.readouterr().out
    numbers = [[line.split()[-4:] for line in text.splitlines() if MARK in line] for text in (shown, again)]
    assert numbers[0] == numbers[1]


def test_who_lacks_a_data_set_is_scored_on_the_others_and_told_so(method, published, folder, tmp_path, capsys):
    # The samples of somebody who lacks the rarer data set.
    shutil.copytree(folder, without := tmp_path / "samples")
    for kind in ("causes", "descriptors", "reenactments"):
        shutil.rmtree(without / f"scan_{kind}/{RARE}")
    assert main(["bench", "scans", method, "--samples", str(without), "--out", "said.csv"]) == 0
    shown = capsys.readouterr().out
    assert len(re.findall(f"{MARK}RMSE below its median", shown)) == 1
    assert f"{EVERYWHERE} (" in shown and "All together" not in shown and f"{RARE} (" not in shown
    assert f"RMSE below its median is of {EVERYWHERE} alone." in shown
    assert f"of {EVERYWHERE}, {RARE}, and have learned from the scenes of all of these." in shown
    said = (tmp_path / "said.csv").read_text()
    assert f"\n{EVERYWHERE},{SEED}," in said and f"\n{RARE}," not in said
    assert main(["score", "scans", "said.csv"]) == 0
    assert f" is of {EVERYWHERE} alone." in capsys.readouterr().out


def test_a_data_set_in_part_and_one_that_everyone_has_are_missed_in_one_line(
    method, published, folder, tmp_path, capsys
):
    assert main(["bench", "scans", method, "--samples", str(folder), "--out", "said.csv"]) == 0
    lines = (tmp_path / "said.csv").read_text().splitlines()
    for source in (RARE, EVERYWHERE):
        [first, *_] = [number for number, line in enumerate(lines) if line.startswith(f"{source},")]
        (tmp_path / "part.csv").write_text("\n".join(lines[:first] + lines[first + 1 :]))
        capsys.readouterr()
        assert main(["score", "scans", "part.csv"]) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert f"1 test samples are missing, first source {source}, seed {SEED}" in line
    (tmp_path / "part.csv").write_text("\n".join(line for line in lines if not line.startswith(EVERYWHERE)))
    assert main(["score", "scans", "part.csv"]) == 2
    assert f"8 test samples are missing, first source {EVERYWHERE}" in capsys.readouterr().err


def test_predictions_of_other_samples_and_samples_of_another_config_are_not_shipped(folder, full, tmp_path):
    shutil.copytree(folder, run := tmp_path / "run")
    shutil.rmtree(run / f"scan_causes/{RARE}")
    with pytest.raises(InputError, match=r"seed100\.csv: is of other data sets than there are samples of; finish"):
        collect(TRACK, run, full)
    sidecar = folder / f"scan_causes/{EVERYWHERE}/seed{SEED}.npz.provenance.json"
    recipe = recipe_of(TRACK.file(EVERYWHERE, SEED), full)
    try:
        sidecar.write_text(json.dumps({"settings": recipe.given["settings"], "code": {"commit": "abc"}}))
        assert collect(TRACK, folder, full).commit == "abc"
        sidecar.write_text(json.dumps({"settings": recipe.given["settings"] | {"role": "development"}}))
        with pytest.raises(InputError, match="was not made with the config of run full; give the folder of that run"):
            collect(TRACK, folder, full)
    finally:
        sidecar.unlink()


def test_without_published_rows_the_command_says_so_in_one_line(method, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "FOLDER", tmp_path / "nothing")
    for words in (["bench", "scans", method], ["score", "scans", "said.csv"]):
        assert main(words) == 2
        [line] = capsys.readouterr().err.splitlines()
        assert "scans.npz: no such file, in which the published rows are" in line
        assert line.endswith("gpca ship-predictions --tracks scans")


def test_the_virtual_set_is_made_by_its_recipe_and_loaded_as_an_object(full, shipped, tmp_path, monkeypatch):
    tiny = {"points": 96, "pairs": 1, "ladder_starts": 1, "global_start": False, "times": [3.0]}
    config = full | {"scan_causes": full["scan_causes"] | tiny}
    few = full["scans"]["datasets"][EVERYWHERE] | {"rooms": 0, "objects": 2, "views": 2}
    config["scans"] = full["scans"] | {"datasets": {EVERYWHERE: few}, "points": 100, "scan_points": 2000}
    few_runs = {"descriptors": {"starts": 1, "restarts": 1, "icp_points": 64}, "reenactment": {"hypotheses": 2}}
    config["diagnosis"] = full["diagnosis"] | few_runs
    recipe = recipe_of(TRACK.file(EVERYWHERE, SEED), config)
    paths = {name: tmp_path / path for name, path in recipe.outputs.items()}
    for path in paths.values():
        path.parent.mkdir(parents=True, exist_ok=True)
    measure(Job(**json.loads(json.dumps(recipe.given)), **paths))
    n = len(pd.read_csv(paths["samples"]))
    own = shipped.rows.subset(np.arange(1))
    methods = tuple(replace(each, scores=each.scores[:1], named=each.named[:1]) for each in shipped.methods)
    monkeypatch.setattr(module, "FOLDER", tmp_path)
    replace(shipped, rows=own, methods=methods, hashes={}).save(tmp_path / "scans.npz")
    data = gpca.load("scans", seed=SEED, samples=tmp_path)
    assert (
        data.source == EVERYWHERE
        and len(data) == len(gpca.load("scans", split="test", seed=SEED, samples=tmp_path)) == n
    )
    assert set(data.registrations.cluster) <= {"object_0", "object_1"}
    assert (data.frame()["severity_noise"] > 0).tolist() == (pd.read_csv(paths["samples"])["times"] > 0).tolist()
    with pytest.raises(InputError, match="split 'train': has no samples of the track scans; learn from the samples of"):
        gpca.load("scans", split="train", seed=SEED, samples=tmp_path)
