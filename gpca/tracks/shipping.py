"""Collects what is shipped with a track from a finished run."""

import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import Causes
from gpca.errors import InputError
from gpca.experiments.diagnosis import cause_costs
from gpca.experiments.frame_causes import SAMPLE_COLUMNS
from gpca.experiments.scan_causes import SAMPLE_COLUMNS as SCAN_COLUMNS
from gpca.explainers.registry import explainer_entry
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, numbers, read_csv
from gpca.io.frame import Frame
from gpca.jobs.provenance import read_record
from gpca.objects.canonical import BY_ICP
from gpca.steps.control_samples import HARD
from gpca.tracks.published import LIMITS, NO_CALLS, Method, Published, Rows, predicted, sha256_of_arrays
from gpca.tracks.samples import recipe_of
from gpca.tracks.track import DEFAULT, FRAMES_TRACK, HARD_TRACK, SCANS_TRACK, Track

Part = tuple[str, int]  # source and seed
Key = tuple[str, str]  # name of an explainer, and its training data if there is a choice


def collect(track: Track, run: Path, config: Mapping[str, Any]) -> Published:
    """Return what is shipped with a track, from the folder of a run and its config."""
    parts = [part for part in track.parts(config) if not track.may_lack(part[0]) or (run / track.file(*part)).is_file()]
    for part in parts if track.run != DEFAULT else ():  # otherwise nobody could make the samples again
        settings = read_record(run / track.file(*part)).get("settings")
        expected = recipe_of(track.file(*part), config).given["settings"]
        if settings is not None and settings != json.loads(json.dumps(expected)):
            fault = f"was not made with the config of run {config['run']}"
            raise InputError(run / track.file(*part), fault, "give the folder of that run")
    tested = {}
    for part in parts:
        causes = Causes.load(run / track.file(*part), part)
        tested[part] = causes.subset(causes.rows("test"))
    methods = []
    for key, by_part in _predictions(track, run, config, parts).items():
        for part in parts:
            samples = [str(number) for number in tested[part].registrations.sample]
            if part not in by_part or by_part[part]["sample"].tolist() != samples:
                raise InputError(run, "has predictions of other test samples than its own", "finish the run")
        methods.append(_method(key, track, config, [by_part[part] for part in parts]))
    optional = [pattern.format(source=source, seed=seed) for pattern in track.read for source, seed in parts]
    folders = product(track.training_folders, config["sources"], dict.fromkeys(seed for _, seed in parts))
    optional += [f"{folder}/{source}/seed{seed}.npz" for folder, source, seed in folders]
    files = [track.file(*part) for part in parts] + [file for file in optional if (run / file).is_file()]
    limits = {name: getattr(tested[parts[0]].truth, name) for name in LIMITS}
    code = read_record(run / track.file(*parts[0])).get("code")
    commit = code.get("commit") or "" if isinstance(code, dict) else ""
    hashes = {file: sha256_of_arrays(run / file) for file in files}
    return Published(track, _rows(track, run, tested), limits, tuple(methods), hashes, commit)


def _rows(track: Track, run: Path, tested: Mapping[Part, Causes]) -> Rows:
    columns: dict[str, list] = {}
    for (source, seed), causes in tested.items():
        n, registrations = len(causes), causes.registrations
        arrays: dict[str, Any] = {name: getattr(registrations, name) for name in ("sample", "cluster", "concept")}
        for again, truth in {"": causes.truth, "_again": causes.truth_again}.items():
            arrays |= {f"error{again}": truth.error, f"uncertainty{again}": truth.uncertainty}
        arrays |= {
            "source": np.full(n, source),
            "seed": np.full(n, seed),
            "object": registrations.object_name,
            "symmetric": causes.symmetric,
            "error_shown": causes.error_shown,
            "uncertainty_limit": np.full(n, causes.truth.uncertainty_limit),
            "start": np.full(n, "none"),
            "instance": np.arange(n),
            "scene": registrations.cluster,
            "counted": np.ones(n, bool),
        }
        if track.name in (FRAMES_TRACK, SCANS_TRACK):
            on_frames = track.name == FRAMES_TRACK
            path = run / (f"frame_causes/seed{seed}.csv" if on_frames else f"scan_causes/{source}/seed{seed}.csv")
            rows = read_csv(path, SAMPLE_COLUMNS if on_frames else SCAN_COLUMNS, others=ANY)
            require_same_samples(path, rows, {"sample": registrations.sample}, "causes", ("sample",))
            arrays["start"] = rows["start"].to_numpy(str)
            if on_frames:
                arrays["instance"] = rows["instance"].to_numpy(int)
                arrays["scene"] = (rows["dataset"] + " " + rows["scene"]).to_numpy(str)
                arrays["counted"] = (rows["truth"] != BY_ICP).to_numpy()
            else:
                arrays["counted"] = numbers(path, rows, "times") == 0
        for name, column in arrays.items():
            columns.setdefault(name, []).append(column)
    return Rows(axes=None, **{name: np.concatenate(parts) for name, parts in columns.items()})


def _predictions(track: Track, run: Path, config: Mapping[str, Any], parts: list[Part]) -> dict[Key, dict[Part, Frame]]:
    predictions: dict[Key, dict[Part, Frame]] = {}
    for source, seed in parts:
        if not track.predictions:
            for name in config["diagnosis"]["explainers"]:
                rows = read_predictions(run / f"diagnoses/{source}/{name}/seed{seed}.csv")
                predictions.setdefault((name, ""), {})[source, seed] = rows[rows["split"] == "test"]
            continue
        path = run / track.predictions.format(source=source, seed=seed)
        rows = read_predictions(path, labels=track.labeled_by).assign(**{} if track.learn_from else {"learned": ""})
        if "scans" in rows and set(rows["scans"]) != {name for name, of in parts if of == seed}:
            raise InputError(path, "is of other data sets than there are samples of", "finish the run")
        for column, wanted in {"control": HARD, "scans": source}.items():
            rows = rows[rows[column] == wanted] if column in rows else rows
        for (name, learned), method_rows in rows.groupby(["explainer", "learned"], sort=False):
            test_rows = method_rows[method_rows["split"] == "test"]
            predictions.setdefault((str(name), str(learned)), {})[source, seed] = test_rows
    if not predictions:
        raise InputError(run, f"has no predictions for the track {track.name}", "finish the run")
    return predictions


def _method(key: Key, track: Track, config: Mapping[str, Any], parts: list[Frame]) -> Method:
    import pandas as pd

    rows = pd.concat(parts)
    scores_N_C, named_N = predicted(rows, track.labels)
    name, training = key
    entry = explainer_entry(name, track.kind)
    costs = cause_costs(config, [*config["diagnosis"]["explainers"], *config["diagnosis"]["by_features"]])
    calls = costs[name]["icp_calls"] if name in costs else NO_CALLS
    if track.name in (HARD_TRACK, SCANS_TRACK):  # their files have a column of calls
        calls = round(rows["icp_calls"].mean())
    other = "" if training in ("", *track.learn_from[:1]) else f" (from {training})"  # than the default data
    return Method(name + other, entry.title + other, entry.sight, int(calls), np.nan_to_num(scores_N_C), named_N)
