"""Collects from a finished run what is shipped of a track."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import Causes
from gpca.errors import InputError
from gpca.experiments.controls.settings import HARD
from gpca.experiments.diagnosis.experiment import shown as titles_and_costs
from gpca.experiments.frame_causes.metrics import SAMPLE_COLUMNS
from gpca.experiments.scan_causes.metrics import SAMPLE_COLUMNS as SCAN_COLUMNS
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import ANY, numbers, read_csv
from gpca.objects.splits import BY_ICP
from gpca.tracks.published import LIMITS, NO_CALLS, NOTHING_NAMED, Method, Published, Rows
from gpca.tracks.recipes import recipe_of
from gpca.tracks.samples import hashes_of
from gpca.tracks.track import FRAMES_TRACK, HARD_TRACK, SCANS_TRACK, Track

if TYPE_CHECKING:
    import pandas as pd

Key = tuple[str, str]  # name of an explainer, and where it learned if there is a choice


def collect(track: Track, run: Path, config: Mapping[str, Any]) -> Published:
    """Return what is shipped of a track, from the folder of a run.

    Args:
        config: that the run was made with, as :func:`gpca.config.check.read` returned it.

    Raises:
        InputError: a file that is missing or damaged, samples of another config, predictions of other samples.
    """
    parts = [part for part in track.parts(config) if not track.may_lack(part[0]) or (run / track.file(*part)).is_file()]
    for source, seed in parts if track.layers else ():
        _require_config(run, track.file(source, seed), config)
    tested = {part: _tested(run / track.file(*part), part) for part in parts}
    rows = _rows(track, run, tested)
    methods = []
    for key, of_part in _said(track, run, config, parts).items():
        methods.append(_method(key, track, config, [_of_part(of_part.get(part), tested[part], run) for part in parts]))
    also = [pattern.format(source=source, seed=seed) for pattern in track.read for source, seed in parts]
    lessons = [
        f"{folder}/{source}/seed{seed}.npz"
        for folder in track.lessons
        for source in config["sources"]
        for seed in dict.fromkeys(seed for _, seed in parts)
    ]
    files = [track.file(*part) for part in parts] + [file for file in also + lessons if (run / file).is_file()]
    truth = tested[parts[0]].truth
    limits = {name: getattr(truth, name) for name in LIMITS}
    return Published(track, rows, limits, tuple(methods), hashes_of(run, files), _commit(run / track.file(*parts[0])))


def _tested(path: Path, part: tuple[str, int]) -> Causes:
    causes = Causes.load(path, part)
    return causes.subset(causes.rows("test"))


def _rows(track: Track, run: Path, tested: Mapping[tuple[str, int], Causes]) -> Rows:
    columns: dict[str, list] = {}
    for (source, seed), causes in tested.items():
        n, registrations = len(causes), causes.registrations
        of_part: dict[str, Any] = {
            "source": np.full(n, source),
            "seed": np.full(n, seed),
            "sample": registrations.sample,
            "object": registrations.object_name,
            "cluster": registrations.cluster,
            "concept": registrations.concept,
            "symmetric": causes.symmetric,
            "error": causes.truth.error,
            "uncertainty": causes.truth.uncertainty,
            "error_again": causes.truth_again.error,
            "uncertainty_again": causes.truth_again.uncertainty,
            "error_shown": causes.error_shown,
            "uncertainty_limit": np.full(n, causes.truth.uncertainty_limit),
            "start": np.full(n, "none"),
            "instance": np.arange(n),
            "scene": registrations.cluster,
            "counted": np.ones(n, bool),
        }
        if track.name == FRAMES_TRACK:
            of_part |= _of_frames(run / f"frame_causes/seed{seed}.csv", registrations.sample)
        if track.name == SCANS_TRACK:
            of_part |= _of_scans(run / f"scan_causes/{source}/seed{seed}.csv", registrations.sample)
        for name, column in of_part.items():
            columns.setdefault(name, []).append(column)
    return Rows(**{name: np.concatenate(parts) for name, parts in columns.items()})


def _of_frames(path: Path, sample_N: np.ndarray) -> dict[str, np.ndarray]:
    rows = _of_samples(path, SAMPLE_COLUMNS, sample_N)
    return {
        "start": rows["start"].to_numpy(str),
        "instance": rows["instance"].to_numpy(int),
        "scene": (rows["dataset"] + " " + rows["scene"]).to_numpy(str),
        "counted": (rows["truth"] != BY_ICP).to_numpy(),
    }


def _of_scans(path: Path, sample_N: np.ndarray) -> dict[str, np.ndarray]:
    rows = _of_samples(path, SCAN_COLUMNS, sample_N)
    return {"start": rows["start"].to_numpy(str), "counted": numbers(path, rows, "times") == 0}


def _of_samples(path: Path, columns: tuple[str, ...], sample_N: np.ndarray) -> pd.DataFrame:
    rows = read_csv(path, columns, others=ANY)
    if rows["sample"].tolist() != [str(number) for number in sample_N]:
        raise InputError(path, "its samples differ from those of the causes", "regenerate both from the same config")
    return rows


def _said(
    track: Track, run: Path, config: Mapping[str, Any], parts: Iterable[tuple[str, int]]
) -> dict[Key, dict[tuple[str, int], pd.DataFrame]]:
    """Return the predictions of every method, by part."""
    said: dict[Key, dict[tuple[str, int], pd.DataFrame]] = {}
    for source, seed in parts:
        if not track.said:
            for name in config["diagnosis"]["explainers"]:
                path = run / f"diagnoses/{source}/{name}/seed{seed}.csv"
                said.setdefault((name, ""), {})[source, seed] = read_predictions(path)
            continue
        path = run / track.said.format(source=source, seed=seed)
        rows = read_predictions(path, labels=track.labeled_by).assign(**{} if track.learn_from else {"learned": ""})
        if "scans" in rows and set(rows["scans"]) != {name for name, of in parts if of == seed}:
            raise InputError(path, "is of other data sets than there are samples of", "finish the run")
        for column, wanted in {"control": HARD, "scans": source}.items():
            rows = rows[rows[column] == wanted] if column in rows else rows
        for key, of_method in rows.groupby(["explainer", "learned"], sort=False):
            said.setdefault((str(key[0]), str(key[1])), {})[source, seed] = of_method
    if not said:
        raise InputError(run, f"has no predictions for the track {track.name}", "finish the run")
    return said


def _require_config(run: Path, file: str, config: Mapping[str, Any]) -> None:
    """Raise an InputError for a file that was made with other settings than the config has, where it says with which.

    Else nobody could make it again.
    """
    said = _provenance(run / file).get("settings")
    if said is not None and said != json.loads(json.dumps(recipe_of(file, config).given["settings"])):
        raise InputError(
            run / file, f"was not made with the config of run {config['run']}", "give the folder of that run"
        )


def _of_part(rows: pd.DataFrame | None, causes: Causes, run: Path) -> pd.DataFrame:
    rows = rows[rows["split"] == "test"] if rows is not None else None
    if rows is None or rows["sample"].tolist() != [str(number) for number in causes.registrations.sample]:
        raise InputError(run, "has predictions of other test samples than its own", "finish the run")
    return rows


def _method(key: Key, track: Track, config: Mapping[str, Any], parts: list[pd.DataFrame]) -> Method:
    import pandas as pd

    rows = pd.concat(parts)
    scores_N_C = rows[[f"score_{label}" for label in track.labels]].to_numpy(float)
    number = {label: place for place, label in enumerate(track.labels)}
    named = np.where(rows["abstained"], "", rows["concept_predicted"].to_numpy(str))
    named_N = np.array([number.get(label, NOTHING_NAMED) for label in named])
    name, lesson = key
    entry = explainer_entry(name, track.kind)
    costs = titles_and_costs(config, {})["cause_costs"]
    calls = costs[name]["icp_calls"] if name in costs else NO_CALLS
    if track.name in (HARD_TRACK, SCANS_TRACK):  # their files have it
        calls = round(rows["icp_calls"].mean())
    name, title = (track.with_lesson(text, lesson) for text in (name, entry.title))
    return Method(name, title, entry.sight, int(calls), np.nan_to_num(scores_N_C), named_N)


def _commit(path: Path) -> str:
    """Return the commit that a file of the run was made with, empty where that is not known."""
    code = _provenance(path).get("code")
    return code.get("commit") or "" if isinstance(code, dict) else ""


def _provenance(path: Path) -> dict[str, Any]:
    """Return what is known of how a file of the run was made; nothing where it does not say."""
    try:
        record = json.loads(path.with_name(path.name + ".provenance.json").read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}
