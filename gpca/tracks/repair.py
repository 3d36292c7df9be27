"""The track ``repair``: a function of one's own beside the rivals, on the samples of ``causes`` (docs/adding.md)."""

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.experiments.repair import mean_seconds, measured, own_settings, repair_sheet, titles_of
from gpca.objects.canonical import ObjectClouds
from gpca.process.plugins import load
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reporting.tables.table import Table
from gpca.settings import read_settings
from gpca.steps.repair import Attempts, RepairSettings, World, searched, try_all
from gpca.steps.repair_verdicts import CAUSES, verdicts
from gpca.tracks.samples import TrackSamples

TRACK, FUNCTION = "repair", "repair"
Own = Callable[[np.ndarray, np.ndarray, np.ndarray], object]


def own_function(file: str) -> Own:
    """Return the function of a file or a module."""
    function = getattr(load(file), FUNCTION, None)
    if not callable(function):
        fault = f"has no function {FUNCTION}, which the track {TRACK} asks"
        raise InputError(file, fault, f"give it def {FUNCTION}(source, target, T_init), which returns a pose")
    return function


def repair_table(samples: TrackSamples, function: Own, name: str) -> Table:
    """Ask a function about all test samples, and return its row among the others."""
    import pandas as pd

    config = samples.config
    if name in titles_of(config):
        name = f"{name} (here)"
    parts = [(source, seed) for source, seed, _ in samples.parts()]
    attempts = samples.files(f"repairs/{CAUSES}/{source}/seed{seed}.npz" for source, seed in parts)
    settings = own_settings(config, {}, config["diagnosis"]["reenactment"])
    truth = CauseSettings.from_dict(settings["causes"], settings["icp"])
    reenactment = read_settings(ReenactmentSettings, settings["reenactment"])
    asked = read_settings(RepairSettings, settings["repair"] | {"methods": {}})
    files, seconds = [], []
    for (source, seed), path in zip(parts, attempts, strict=True):
        print(f"{name}: {source}, seed {seed}", file=sys.stderr)
        others, axes = Attempts.load(path, (source, seed)), (source, seed)
        [causes_path, objects_path] = samples.files([samples.track.file(source, seed), f"objects/{source}.npz"])
        causes = Causes.load(causes_path, axes)
        tested = causes.subset(causes.rows("test"))
        causes = tested.subset(np.flatnonzero(np.isin(tested.registrations.sample, others.sample_N)))
        world = World(causes, {}, ObjectClouds.load(objects_path, source))
        alone, spent = try_all(
            world, asked, truth.icp, truth.moved, lambda pair, _row: searched(pair, reenactment), axes, {name: function}
        )
        files.append((source, seed, beside(others, alone)))
        seconds.append(spent.assign(source=source, seed=seed))
    intervals = measured(verdicts({CAUSES: files}, config["success"]["error"]))
    titles = titles_of(config) | {name: f"→ {name}", f"{name}_judged": f"→ {name}, by the judge"}
    sheet = repair_sheet(titles, intervals, mean_seconds(pd.concat(seconds)))
    return sheet.table("Track repair: failed registrations that are repaired, good ones that are harmed", "metric", ())


def beside(others: Attempts, alone: Attempts) -> Attempts:
    """Return the attempts of others with the last rival of the same registrations as one more."""
    names = [name for name, declared in Attempts.array_fields().items() if {"C", "M"} & set(declared.shape[1:])]
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(others, name), getattr(alone, name)[:, -1:]], axis=1) for name in names
    }
    return replace(others, **columns, method_M=np.append(others.method_M, alone.method_M[-1:]))
