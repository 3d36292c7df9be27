"""Registration methods on pairs of scans, by how much these overlap and where local methods start (Table XVII)."""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from gpca.alignment.methods.registry import installed, method_entry, method_module, require_global, require_settings
from gpca.declarations import Experiment, Frame, LeftOut, Names, Paths, Run, numbers, plain, table
from gpca.declarations.step import Plan, Step, Wildcards
from gpca.errors import InputError, require_names, with_key
from gpca.evaluation.measures import ALL, Clustered, Measure, Parts, by_value, over_seeds, read_samples
from gpca.experiments.registration_methods import method_rows, missing_methods, read_seconds, row_name
from gpca.io.csv_file import read_numbers
from gpca.objects.entry import Name, title_of
from gpca.reporting.sheet import Row, Sheet, plain_cell, plural, show, where
from gpca.scans.pair import Rung, ScanSuccess
from gpca.scans.scene import stratum_name, stratum_of
from gpca.scans.source import ScanEntry, data_files, entry_of, place_of
from gpca.settings import Bounds, Count, Share, fields_of, read_settings
from gpca.steps.registration_trials import INITIAL
from gpca.steps.scans import TrialSettings


@dataclass(frozen=True, kw_only=True)
class ChoiceSettings:
    """Which pairs of scans are drawn.

    Attributes:
        strata: edges of the strata of overlap, ascending.
        pairs: of each scene, stratum and seed, at most.
        scan_points: larger scans are thinned to this number of points, drawn at random.
    """

    strata: Annotated[tuple[Share, ...], Field(min_length=2)] = (0.1, 0.3, 0.5, 0.7, 1.0)
    pairs: Count = 2
    scan_points: Annotated[int, Bounds(minimum=100)] = 20000

    def __post_init__(self) -> None:
        if sorted(set(self.strata)) != list(self.strata):
            raise InputError("strata", f"{list(self.strata)} is not in ascending order", "sort the edges")


@dataclass(frozen=True, kw_only=True)
class ScanSettings(ChoiceSettings, TrialSettings):
    """The section ``scans`` of the config.

    Attributes:
        seeds: how many of the run's seeds, from the first; each draws other pairs and starts.
        datasets: by name.
        success: when a registration is correct.
        methods: settings of registration methods on scans, instead of those that ``methods`` has.
    """

    datasets: Annotated[dict[Name, ScanEntry], Field(min_length=1)]
    seeds: Count = 1
    success: ScanSuccess = field(default_factory=ScanSuccess)
    methods: dict[str, dict | None] = field(default_factory=dict)


def check(config: dict, left_out: LeftOut) -> None:
    section = config["scans"]
    with_key("scans", read_settings, ChoiceSettings, fields_of(section, ChoiceSettings))
    for name, settings in section["methods"].items():
        with_key(f"scans.methods.{name}", require_settings, name, settings or {})
    key = "scans.global_start"
    require_names(key, [section["global_start"]], config["methods"], "registration method", left_out("methods"))
    with_key(key, require_global, section["global_start"])
    for name, settings in section["datasets"].items():
        if name in config["sources"]:
            raise InputError(f"config key scans.datasets.{name}", "is the name of a source too", "choose another name")
        if (entry := entry_of(settings)).location and entry.kind != "virtual":
            with_key(f"scans.datasets.{name}", place_of, entry, config["data_dir"])


def present(config: Mapping[str, Any]) -> dict[str, ScanEntry]:
    """Data sets without those that are optional and do not exist, by name."""
    entries = {name: entry_of(settings) for name, settings in plain(config["scans"]["datasets"]).items()}
    folder = config["data_dir"]
    return {name: entry for name, entry in entries.items() if entry.kind == "virtual" or place_of(entry, folder)}


def titles_of_scans(config: Mapping[str, Any]) -> dict[str, str]:
    return {
        name: title_of({"title": entry.title, "stand_in": entry.stand_in}) for name, entry in present(config).items()
    }


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    there = present(config)
    return {
        "scan_set": list(there),
        "scan_benchmark": [name for name, entry in there.items() if entry.benchmark],
        "scan_seed": list(config["seeds"])[: config["scans"]["seeds"]],
        "scan_method": installed(config["methods"]),
    }


EXPERIMENT = Experiment(
    name="scans",
    sections={"scans": ScanSettings},
    needs=("scan_set", "scan_method"),
    names=names,
    check=check,
    optional_entries={"scans.datasets": Names("data set of scans")},
    lists={"scans.methods": "methods"},
)

EACH_SET = {"source": "scan_set", "seed": "scan_seed"}  # of scans and seed


def files_of_set(plan: Plan, wildcards: Wildcards) -> list[Path]:
    return data_files(present(plan.config)[wildcards.source], plan.config["data_dir"])


def place_of_set(plan: Plan, wildcards: Wildcards) -> str:
    """File or folder of a data set of scans; empty for a virtual one."""
    return str(place_of(present(plan.config)[wildcards.source], plan.config["data_dir"]) or "")


DRAW = Step(
    name="draw_scans",
    run="gpca.steps.scans:draw_scans",
    data=files_of_set,
    outputs={"out": "scans/{source}/seed{seed}.npz"},
    settings=lambda plan, wildcards: {
        "entry": plan.config["scans"]["datasets"][wildcards.source],
        "choice": fields_of(plan.config["scans"], ChoiceSettings),
        "role": plan.config["splits"]["role"],
    },
    params={"place": place_of_set},
    where=EACH_SET,
    target="scan_pairs",
    priority=3,
)
REGISTER = Step(
    name="register_scans",
    run="gpca.steps.scans:register",
    inputs={"scans": "scans/{source}/seed{seed}.npz"},
    outputs={
        "rows": "scan_trials/{source}/{*method}/seed{seed}.csv",
        "timings": "timings/{source}/method_{*method}/seed{seed}.csv",
    },
    settings=lambda plan, _wildcards: {
        "scans": fields_of(plan.config["scans"], TrialSettings),
        "methods": {
            name: plan.config["scans"]["methods"].get(name) or plan.config["methods"][name]
            for name in plan.names["scan_method"]
        },
    },
    modules=lambda plan: map(method_module, plan.names["scan_method"]),
    where=EACH_SET | {"method": "scan_method"},
    priority=2,
)

RECALL, FAILED, CLOSE = "recall", "failed", "recall_15deg_30cm"
CLOSE_DEG, CLOSE_M = 15.0, 0.3  # of rotation and translation: the other criterion of 3DMatch, as Zhang et al. 2023
LISTS = {"3DMatch": (0.3, 1.0), "3DLoMatch": (0.1, 0.3)}  # the benchmark's lists of pairs, by overlap
TRIAL_COLUMNS = ("size_m", "overlap", "rmse_m", "rotation_error_rad", "translation_error_m", "fitness")
TEXTS = ("sample", "pair", "cluster", "kind", "rung", "start", "failure", "inlier_rmse")


@numbers("scans.csv", files="scan_trials/{scan_set}/{scan_method}/seed{scan_seed}.csv")
def collect(run: Run, files: Paths) -> Frame:
    """Recalls and failures of every data set, method and start, with intervals over scenes.

    ``concept`` is ``all``, a stratum, a rung of the ladder, or one of the benchmark's lists. A registration is correct
    by the RMSE over the true overlap (:mod:`gpca.scans.pair`), whatever the method says of it, as in 3DMatch's
    benchmark; a method that ends without any correspondence has no pose, so it is not correct.
    """
    import pandas as pd

    strata, success = list(run.config["scans"]["strata"]), ScanSuccess(**run.config["scans"]["success"])

    def parts(trials: Frame) -> Parts:
        overlap_N = trials["overlap"].to_numpy()
        masks = by_value(trials, "stratum", sorted(set(trials["stratum"]) - {""}))
        for name, (low, high) in LISTS.items():
            masks[name] = (overlap_N >= low) & ((overlap_N < high) | ((high == 1) & (overlap_N == 1)))
        return masks | {name: (trials["rung"] == name).to_numpy() for name in trials["rung"].unique()}

    rows = read_samples(files, lambda path: read_numbers(path, (*TRIAL_COLUMNS, *TEXTS), TRIAL_COLUMNS))
    limit_N = np.where(rows["kind"] == "room", success.room_m, success.object_share * rows["size_m"])
    is_close = np.rad2deg(rows["rotation_error_rad"]) < CLOSE_DEG
    right = {
        RECALL: (rows["fitness"] > 0) & (rows["rmse_m"] < limit_N),
        FAILED: rows["failure"] != "",
        CLOSE: (rows["fitness"] > 0) & is_close & (rows["translation_error_m"] < CLOSE_M),
    }
    measured = {name: Measure(name) for name in right}
    rows["method"] = [row_name(*each) for each in zip(rows["method"], rows["start"], strict=True)]
    rows["stratum"] = [stratum_of(share, strata) or "" for share in rows["overlap"]]
    frames = []
    for (source, _), trials in rows.assign(table="scans", **right).groupby(["source", "method"], sort=False):
        draws = Clustered.drawn(trials["seed"], trials["cluster"], "scan intervals", source)
        frames.append(over_seeds(trials.reset_index(drop=True), parts, measured, draws))
    return pd.concat(frames, ignore_index=True)


SECTION = "Beyond the paper: scans registered to scans"
SCENES = "scenes"  # the clusters
INTERVALS = {"intervals": "scans.csv"}


def _rows(run: Run) -> Iterable[Row]:
    for name, title in titles_of_scans(run.config).items():
        for row in method_rows(run.config["methods"], run.config["scans"]["global_start"], "Ladder"):
            yield Row([(name, title), *row.labels], {"source": name} | dict(row.where))


def _notes(run: Run, sheet: Sheet, intervals: Frame, parts: Iterable[str]) -> list[str]:
    success, counts = run.config["scans"]["success"], []
    for name, title in dict.fromkeys(row.labels[0] for row in sheet.rows):
        most = where(intervals, {"source": name, "metric": RECALL}).groupby("concept")[["samples", "clusters"]].max()
        samples, scenes = most["samples"], plural(int(most["clusters"][ALL]), "scene")
        counts.append(f"{title}: {', '.join(str(int(samples.get(part, 0))) for part in parts)}, of {scenes}")
    there = present(run.config)
    left_out = [entry_of(each) for name, each in plain(run.config["scans"]["datasets"]).items() if name not in there]
    absent = [f"{entry.title} ({entry.address})" if entry.address else entry.title for entry in left_out]
    return [
        f"{sheet.over(clusters=SCENES)}. Correct: the RMSE over the points that the target has "
        f"as well is below {success['room_m']:g} m in rooms and {100 * success['object_share']:g} % of the size of "
        "objects. Bold: best of a start.",
        f"Pairs of all seeds, by column: {'; '.join(counts)}.",
        *([f"Not there, so left out: {', '.join(absent)}."] if absent else []),
        *missing_methods(run.config["methods"]),
    ]


@table(
    SECTION,
    "Table XVII: registration of scans",
    """How often each method registers one scan to another, by how much they overlap. Local methods start at the true
    pose disturbed by a rung of a ladder, and again at a global method's. Compare only rows of one start. CSV also has
    successes by rung.""",
    **INTERVALS,
    seconds=(read_seconds, "timings/{scan_set}/method_{scan_method}/seed{scan_seed}.csv"),
)
def table17_scans(run: Run, intervals, seconds):
    strata = {stratum_name(*ends): "{:g} to {:g} (%)".format(*ends) for ends in pairwise(run.config["scans"]["strata"])}
    rungs = [Rung(**each) for each in run.config["scans"]["ladder"]]
    starts = {each.name: f"From {each.rotation_deg:g}°, {each.translation_m:g} m (%)" for each in rungs}
    seconds_look: dict[str, Any] = {"decimals": 2, "interval": False, "limits": (0, inf), "least_is_best": True}
    columns = {
        **{key: show(RECALL, title, key) for key, title in (strata | {ALL: "All (%)"}).items()},
        FAILED: show(FAILED, "Failed (%)", interval=False, least_is_best=True),
        "seconds": show("seconds", "s", factor=1, frame="seconds", **seconds_look),
        **{key: show(RECALL, title, key) for key, title in starts.items()},
    }
    heads, rows = {"data": "Scans", "start": "Start", "method": "Method"}, _rows(run)

    def blank(row: Row, key: str) -> bool:
        return key in starts and row.labels[1][0] != INITIAL

    sheet = Sheet("table17_scans", heads, rows, columns, intervals, {"seconds": seconds}, blank=blank)
    note = (
        "Failed: given up by the method itself, or not at rest; the pose counts in the other columns all the same. s: "
        "with the global start, without voxels and normals; it differs from run to run. From: of the local "
        "registrations that start with that error of the pose."
    )
    footnotes = [*_notes(run, sheet, intervals, strata), note]
    caption = "Registrations of scans that succeed, by overlap"
    return sheet.table(caption, "overlap", footnotes, bold=columns, same=2, keep_empty=True)


@table(
    SECTION,
    "Table XVII beside published recalls",
    """Global methods on the benchmark's two lists of pairs, by the criterion that others use for them, beside what
    they have published for the same solvers on learned features.""",
    needs=("scan_set", "scan_method", "scan_benchmark"),
    **INTERVALS,
)
def table17_published(run: Run, intervals):
    entries, titles, rows = present(run.config), titles_of_scans(run.config), []
    for dataset in (name for name, entry in entries.items() if entry.benchmark):
        for name in installed(run.config["methods"]):
            if (solver := method_entry(name)).is_global:
                labels = [("run", f"This run, {titles[dataset]}"), (name, solver.title), ("FPFH", "FPFH")]
                rows.append(Row(labels, {"source": dataset, "method": name}))
    title = "{}, overlap {:g} to {:g} (%)"
    columns = {name: show(CLOSE, title.format(name, *ends), name) for name, ends in LISTS.items()}
    heads = {"by": "By", "method": "Method", "features": "Features"}
    sheet = Sheet("table17_published", heads, rows, columns, intervals)
    over = sheet.over(clusters=SCENES)
    with Path(__file__).with_name("published_scans.csv").open(encoding="utf-8", newline="") as file:
        published = list(csv.DictReader(file))
    for title in dict.fromkeys(row["title"] for row in published):
        recalls = [row for row in published if row["title"] == title]
        method, features = recalls[0]["method"], recalls[0]["features"]
        labels = [("published", "Published"), (method, title), (features, features)]
        sheet.add_row(labels, {row["list"]: plain_cell(float(row["recall"]), 1, 0) for row in recalls}, rival=False)
    sources = "; ".join(dict.fromkeys(row["source"] for row in published))
    note = (
        f"{over}. Correct: rotation off by less than {CLOSE_DEG:g}° "
        f"and translation by less than {100 * CLOSE_M:g} cm, as where the others were published: {sources}. Those "
        "match learned features (FCGF) on all pairs of the benchmark's eight scenes; this run has a sample of the "
        "pairs, as many of each stratum, of the scenes that it was given."
    )
    caption = "Recall of 3DMatch and 3DLoMatch beside published recalls"
    return sheet.table(caption, "list", [note], keep_empty=True)
