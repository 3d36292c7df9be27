"""The fixed samples of the tracks: cached, checked by hash, and made from the repository's data where missing."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple, Self

import numpy as np

from gpca.errors import InputError
from gpca.frames.source import REAL_WORLD
from gpca.jobs.provenance import RECORD
from gpca.process.code_files import ROOT
from gpca.process.plugins import named
from gpca.process.progress import progress
from gpca.steps.control_samples import HARD, HARD_REENACTMENTS
from gpca.tracks.published import Published, require_clone, sha256_of_arrays
from gpca.tracks.track import DEFAULT, Track

LEARNED = ("cause_embeddings", "cause_encoders", "control_embeddings")  # their last digits depend on the processor
# The process is limited before this module loads NumPy.
_IN_PROCESS = (
    "from gpca.jobs.job import keep_freed_memory; from gpca.process.processor import prepare; "
    "prepare(1); keep_freed_memory(); from gpca.tracks.samples import run_recipe; run_recipe()"
)


@dataclass(frozen=True)
class TrackSamples:
    """The samples of a track."""

    track: Track
    published: Published
    folder: Path  # holds them as the folder of a run does, which may serve as well
    processes: int = 1  # number of files that are made at a time
    data_dir: Path | None = None  # data that the repository does not have

    @classmethod
    def of(
        cls, track: Track, cache: Path | None = None, processes: int | None = None, data_dir: Path | None = None
    ) -> Self:
        """Return the samples of a track, in the user's cache or another folder."""
        return cls(track, Published.load(track), cache or cache_of(track), processes or os.cpu_count() or 1, data_dir)

    @cached_property
    def config(self) -> dict[str, Any]:
        """The config of the track's run."""
        require_clone(f"track {self.track.name}")
        return self.track.config(plugins=named(), data_dir=str(self.data_dir) if self.data_dir else None)

    def parts(self) -> list[tuple[str, int, np.ndarray]]:
        """Return source, seed and row numbers of the published samples that are cached or whose data is available."""
        from gpca.experiments.scans import present

        return [
            (source, seed, rows)
            for source, seed, rows in self.published.rows.parts()
            if not self.track.may_lack(source)
            or (self.folder / self.track.file(source, seed)).is_file()
            or source in present(self.config)
        ]

    def files(self, names: Iterable[str]) -> list[Path]:
        """Return files by their paths below the folder; missing ones are made, and all are checked."""
        names = list(names)
        if self.folder == cache_of(self.track) and any(self._fault(name) for name in names):
            self._clear()  # what an earlier version made
        if missing := [name for name in names if not (self.folder / name).is_file()]:
            make(missing, self.folder, self.config, self.processes)
        for name in names:
            if fault := self._fault(name):
                remedy = "remove it, and make it with the commit that published them"
                remedy += f", {self.published.commit[:12]}" if self.published.commit else ""
                raise InputError(self.folder / name, fault, remedy)
        return [self.folder / name for name in names]

    def _clear(self) -> None:
        """Remove what the suite has made here, which has a record beside it, and nothing else."""
        for record in self.folder.rglob(f"*{RECORD}"):
            file = record.with_name(record.name.removesuffix(RECORD))
            with suppress(InputError, ValueError, LookupError):  # the file of someone else
                recipe_of(str(file.relative_to(self.folder)), self.config)
                file.unlink(missing_ok=True)
                record.unlink(missing_ok=True)

    def _fault(self, name: str) -> str:
        """Return how a file differs from the expected one; empty where it does not, or is missing."""
        expected, path = self.published.hashes.get(name), self.folder / name
        if expected is None or name.split("/")[0] in LEARNED or not path.is_file():
            return ""
        actual = sha256_of_arrays(path)
        fault = f"differs from what the published rows were made with ({actual[:12]} is not {expected[:12]})"
        return "" if actual == expected else fault


def cache_of(track: Track) -> Path:
    """Return the user's folder for samples: one for all tracks of the same config."""
    import pooch

    return Path(pooch.os_cache("gpca-bench" if track.run == DEFAULT else f"gpca-bench-{track.run}"))


class Recipe(NamedTuple):
    """How files are made: paths are below the folder of samples, but for data, whose paths begin with ``/``."""

    step: str
    given: Mapping[str, Any]  # names and settings
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]


def make(files: Iterable[str], folder: Path, config: Mapping[str, Any], processes: int) -> None:
    """Make missing files, by their paths below the folder, and their missing inputs, several at a time."""
    steps: dict[str, Recipe] = {}  # by the first of their outputs
    open_files = list(files)
    while open_files:
        file = open_files.pop()
        if file.startswith("/") or (folder / file).is_file():
            continue
        recipe = recipe_of(file, config)
        first = next(iter(recipe.outputs.values()))
        if first not in steps:
            steps[first] = recipe
            open_files += recipe.inputs.values()
    for _ in progress(_made(steps, folder, processes), "making samples", total=len(steps)):
        pass


def _made(steps: dict[str, Recipe], folder: Path, processes: int) -> Iterator[str]:
    """Run all steps, whose inputs come first, and yield the name of each."""
    while steps:
        waiting = {output for recipe in steps.values() for output in recipe.outputs.values()}
        ready = [name for name, recipe in steps.items() if not waiting & set(recipe.inputs.values())]
        with ThreadPoolExecutor(processes) as pool:
            for name, _ in zip(ready, pool.map(lambda name: _run(steps[name], folder), ready), strict=True):
                yield name
        for name in ready:
            del steps[name]


def _run(recipe: Recipe, folder: Path) -> None:
    sys.stderr.write(f"making {next(iter(recipe.outputs.values()))}\n")  # one write, as several files are made at once
    files = {name: str(folder / path) for name, path in {**recipe.inputs, **recipe.outputs}.items()}
    # Sorted as the rules of the workflow give settings: the first of several datasets comes first in the samples.
    given = json.dumps({"step": recipe.step, "given": dict(recipe.given), "files": files}, sort_keys=True)
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    command, variables = [sys.executable, "-c", _IN_PROCESS], {"PYTHONPATH": paths, "PYTHONSAFEPATH": "1"}
    done = subprocess.run(command, input=given, env={**os.environ, **variables}, text=True, capture_output=True)
    if done.returncode:
        words = done.stderr.strip().splitlines() or ["it ended without a message"]
        raise InputError(f"step {recipe.step}", words[-1].removeprefix(f"{recipe.step}: "), "see the line before")


def run_recipe() -> None:
    """Run the step that standard input describes, and exit as a job of the workflow does."""
    from gpca.jobs.job import Job, as_process, call

    described = json.loads(sys.stdin.read())
    files = {name: Path(path) for name, path in described["files"].items()}
    given = described["given"]
    given["downloads"] = Path(given.get("downloads") or "")
    job = Job(threads=1, **{"data_dir": None} | given, **files)
    sys.exit(as_process(described["step"], lambda: call(described["step"], job)))


def recipe_of(file: str, config: Mapping[str, Any]) -> Recipe:
    """Return how the rules of the workflow make a file of a run, such as ``causes/ycb/seed0.npz``."""
    kind, *rest = PurePosixPath(file).with_suffix("").parts
    if kind == "timings":  # an output of the same step
        return recipe_of(f"{rest[1]}/{rest[0]}/{rest[2]}.npz", config)
    *_, source, name = (REAL_WORLD, *rest)  # files of all depth frames name no source
    source = name if kind in ("objects", "instances") else source
    given: dict[str, Any] = {"source": source}
    given |= {"seed": int(name.removeprefix("seed"))} if name.startswith("seed") else {}
    causes, controls, diagnosis, frames = (config[each] for each in ("causes", "controls", "diagnosis", "real_world"))
    data = {each: config[each] for each in ("data_dir", "downloads")}
    frame_settings = {"datasets": frames["datasets"], "role": config["splits"]["role"]}
    icp = {"icp": config["registrations"]["icp"]}
    objects = {"objects": f"objects/{source}.npz"}

    def path(folder: str, suffix: str = "npz") -> str:
        return f"{folder}/{source}/{name}.{suffix}"

    def timings(step: str) -> str:
        return f"timings/{source}/{step}/{name}.csv"

    inputs = {"causes": path("causes"), "causes_timings": timings("causes")}
    outputs = {kind: path(kind), "timings": timings(kind)}
    if kind in ("objects", "instances"):
        given |= {"surface_points": config["objects"]["surface_points"], **data}
        if source == REAL_WORLD:
            step, inputs = "gpca.steps.frames:instances", _splits("scenes", config)
            settings = frame_settings | {"initial_pose": frames["initial_pose"]}
            outputs = objects | {"instances": f"instances/{source}.npz"}
        else:
            step, inputs = "gpca.steps.pairs:objects", _splits("objects", config)
            settings, outputs = config["sources"][source], {"out": objects["objects"]}
    elif kind == "learning_samples":
        step, inputs, outputs = "gpca.steps.learning_curve:learning_samples", objects, {"samples": file}
        given |= {"seed": config["seeds"][0], "chunk": name.removeprefix("chunk")}
        settings = {"learning_curve": config["learning_curve"], "causes": causes} | icp
    elif kind == "repairs":
        from gpca.experiments.repair import own_settings

        step, inputs = "gpca.steps.repair:attempt", objects | {"causes": path("causes")}
        outputs = {"attempts": file, "timings": timings("repair_causes")}
        settings = own_settings(config, {}, diagnosis["reenactment"])
    elif source == REAL_WORLD and kind in ("frame_causes", "frame_starts", "reenactments"):
        given |= data
        settings = frame_settings | {"causes": causes} | icp
        inputs = _splits("scenes", config) | objects | {"instances": f"instances/{source}.npz"}
        outputs = {"frame_causes": f"frame_causes/{name}.npz", "starts": f"frame_starts/{name}.npz"}
        if kind == "reenactments":
            step, inputs, outputs = "gpca.steps.frames:reenact_frames", inputs | outputs, {kind: path(kind)}
            settings |= {"reenactment": diagnosis["reenactment"] | frames["reenactment"]}
        else:
            step, outputs = "gpca.steps.frames:frame_causes", outputs | {"samples": f"frame_causes/{name}.csv"}
            settings |= {"frames": frames["causes"]}
    elif kind in ("scan_causes", "scan_descriptors", "scan_reenactments"):
        from gpca.experiments.scan_causes import measurement_settings
        from gpca.scans.source import entry_of, place_of

        step, inputs, settings = "gpca.steps.scan_causes:measure", {}, measurement_settings(config, source)
        given |= {"place": str(place_of(entry_of(config["scans"]["datasets"][source]), config["data_dir"]) or "")}
        outputs = {"scan_causes": path("scan_causes"), "samples": path("scan_causes", "csv")}
        outputs |= {each: path(f"scan_{each}") for each in ("descriptors", "reenactments")}
    elif kind in ("causes", HARD):
        step, inputs = "gpca.steps.causes:causes", objects
        outputs = {"causes": path(kind), "candidates": path(kind, "csv"), "timings": timings(kind)}
        settings = causes | (controls["hard"] if kind == HARD else {}) | icp
    elif kind == "descriptors":
        step, settings = "gpca.steps.causes:describe", diagnosis["descriptors"] | icp
    elif kind in ("reenactments", HARD_REENACTMENTS):
        of, own = (HARD, controls["hard"]) if kind == HARD_REENACTMENTS else ("causes", {})
        step, inputs = "gpca.steps.causes:reenact", {"causes": path(of), "causes_timings": timings(of)}
        outputs = {"reenactments": path(kind), "timings": timings(kind)}
        settings = {"reenactment": diagnosis["reenactment"], "causes": causes | own} | icp
    elif kind in ("cause_embeddings", "cause_encoders"):
        step, settings = "gpca.steps.causes:train_on_causes", diagnosis["encoder"]
        outputs = {"weights": path("cause_encoders", "pt"), "curve": path("cause_encoders", "csv")}
        outputs |= {"embeddings": path("cause_embeddings"), "timings": timings("cause_embeddings")}
    elif kind == "control_embeddings":
        step, inputs = "gpca.steps.control_samples:train", {"registrations": path(HARD)}
        outputs = {"embeddings": path(f"{kind}/{HARD}"), "curve": path(f"{kind}/{HARD}", "csv")}
        sizes = {key: value for key, value in controls.items() if key not in ("explainers", "hard")}
        given |= {"control": HARD}
        settings = {"controls": sizes, "encoder": config["encoders"][config["embedding"]["encoder"]]}
    else:
        raise InputError(file, "is not a file of samples", "name one of a track")
    return Recipe(step, given | {"settings": settings}, inputs, outputs)


def _splits(kind: str, config: Mapping[str, Any]) -> dict[str, str]:
    from gpca.objects.source import find_file

    name = config["splits"][kind]
    return {"splits": str(find_file(name, config["data_dir"]))} if name else {}
