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
from gpca.explainers.registry import explainer_entry
from gpca.io.csv_file import ANY, read_csv
from gpca.objects.splits import BY_ICP
from gpca.tracks.published import LIMITS, NO_CALLS, NOTHING_NAMED, Method, Published, Rows
from gpca.tracks.samples import hashes_of
from gpca.tracks.track import CAUSES_TRACK, FRAMES_TRACK, HARD_TRACK, Track

if TYPE_CHECKING:
    import pandas as pd

ALSO_HASHED = {  # of a track, beside its samples: what methods may read
    CAUSES_TRACK: ("descriptors/{source}/seed{seed}.npz", "reenactments/{source}/seed{seed}.npz"),
    HARD_TRACK: (),
    FRAMES_TRACK: ("reenactments/{source}/seed{seed}.npz",),
}


def collect(track: Track, run: Path, config: Mapping[str, Any]) -> Published:
    """Return what is shipped of a track, from the folder of a run.

    Args:
        config: that the run was made with, as :func:`gpca.config.check.read` returned it.

    Raises:
        InputError: a file that is missing or damaged, predictions of other samples.
    """
    parts = track.parts(config)
    tested = {part: _tested(run / track.file(*part), part) for part in parts}
    rows = _rows(track, run, tested)
    methods = []
    for name, of_part in _said(track, run, config, parts).items():
        methods.append(_method(name, track, config, [_of_part(of_part[part], tested[part], run) for part in parts]))
    also = [pattern.format(source=source, seed=seed) for pattern in ALSO_HASHED[track.name] for source, seed in parts]
    lessons = [
        f"{folder}/{source}/seed{seed}.npz"
        for folder in ("causes", "descriptors", "reenactments")
        for source in config["sources"]
        for _, seed in parts
        if track.name == FRAMES_TRACK
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
        for name, column in of_part.items():
            columns.setdefault(name, []).append(column)
    return Rows(**{name: np.concatenate(parts) for name, parts in columns.items()})


def _of_frames(path: Path, sample_N: np.ndarray) -> dict[str, np.ndarray]:
    rows = read_csv(path, SAMPLE_COLUMNS, others=ANY)
    if rows["sample"].tolist() != [str(number) for number in sample_N]:
        raise InputError(path, "its samples differ from those of the causes", "regenerate both from the same config")
    return {
        "start": rows["start"].to_numpy(str),
        "instance": rows["instance"].to_numpy(int),
        "scene": (rows["dataset"] + " " + rows["scene"]).to_numpy(str),
        "counted": (rows["truth"] != BY_ICP).to_numpy(),
    }


def _said(
    track: Track, run: Path, config: Mapping[str, Any], parts: Iterable[tuple[str, int]]
) -> dict[str, dict[tuple[str, int], pd.DataFrame]]:
    """Return the predictions of every method, by part."""
    said: dict[str, dict[tuple[str, int], pd.DataFrame]] = {}
    for source, seed in parts:
        if track.name == CAUSES_TRACK:
            for name in config["diagnosis"]["explainers"]:
                path = run / f"diagnoses/{source}/{name}/seed{seed}.csv"
                said.setdefault(name, {})[source, seed] = read_predictions(path)
            continue
        if track.name == FRAMES_TRACK:
            rows = read_predictions(run / f"frame_diagnoses/seed{seed}.csv", labels=("explainer",))
        else:
            rows = read_predictions(run / f"controls/{source}/seed{seed}.csv", ("control", "tested", "explainer"))
            rows = rows[rows["control"] == HARD]
        for name, of_method in rows.groupby("explainer", sort=False):
            said.setdefault(str(name), {})[source, seed] = of_method
    if not said:
        raise InputError(run, f"has no predictions for the track {track.name}", "finish the run")
    return said


def _of_part(rows: pd.DataFrame, causes: Causes, run: Path) -> pd.DataFrame:
    rows = rows[rows["split"] == "test"]
    if rows["sample"].tolist() != [str(number) for number in causes.registrations.sample]:
        raise InputError(run, "has predictions of other test samples than its own", "finish the run")
    return rows


def _method(name: str, track: Track, config: Mapping[str, Any], parts: list[pd.DataFrame]) -> Method:
    import pandas as pd

    rows = pd.concat(parts)
    scores_N_C = rows[[f"score_{label}" for label in track.labels]].to_numpy(float)
    number = {label: place for place, label in enumerate(track.labels)}
    named = np.where(rows["abstained"], "", rows["concept_predicted"].to_numpy(str))
    named_N = np.array([number.get(label, NOTHING_NAMED) for label in named])
    entry = explainer_entry(name, track.kind)
    costs = titles_and_costs(config, {})["cause_costs"]
    calls = costs[name]["icp_calls"] if track.name != HARD_TRACK and name in costs else NO_CALLS
    if track.name == HARD_TRACK:
        calls = round(rows["icp_calls"].mean())
    return Method(name, entry.title, entry.sight, int(calls), np.nan_to_num(scores_N_C), named_N)


def _commit(path: Path) -> str:
    """Return the commit that a file of the run was made with, from its provenance."""
    sidecar = path.with_name(path.name + ".provenance.json")
    try:
        return json.loads(sidecar.read_text("utf-8"))["code"].get("commit") or ""
    except (OSError, ValueError, LookupError, AttributeError):
        return ""
