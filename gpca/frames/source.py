"""Configured datasets of frames: in a local folder, or at the addresses that they are downloaded from."""

from collections.abc import Mapping
from pathlib import Path

from gpca.errors import InputError
from gpca.frames.bop import scene_files
from gpca.objects.bop import models_folder
from gpca.objects.source import data_files, places_of, require_patterns, resolve

REAL_WORLD = "real_rgbd"  # the source that the frames of a run are
VIRTUAL = "virtual_rgbd"  # frames rendered of models of a run's datasets
ONE_ENCODER = f"{REAL_WORLD}_one_encoder"  # the same, where seeds are those of the classifier alone


def resolve_datasets(datasets: Mapping[str, dict] | None, data_dir: str | None) -> dict[str, dict]:
    """Return the resolved ``real_world.datasets``, without optional ones that no folder has; reads no data."""
    resolved = {}
    for name, entry in (datasets or {}).items():
        if entry.get("optional") and not any(path.is_dir() for path in places_of(entry["location"], data_dir)):
            continue
        files = patterns(entry.get("split", "test"))
        require_patterns(files)
        of = resolve({"title": name, "kind": "bop", **entry}, data_dir) | {"files": files}
        results = of.get("results") or []
        named = [results] if isinstance(results, str) else results
        of["results"] = [str(path) for pattern in named for path in _matching(data_dir, pattern)]
        errors = _matching(data_dir, of["errors"]) if of.get("errors") else []
        of["errors"] = str(errors[0]) if errors else None
        if of.get("models"):
            places = places_of(of["models"], data_dir)
            of["models"] = str(next((path for path in places if path.is_dir()), places[0]))
        for path in (*of["results"], of["errors"]):
            if path and not Path(path).is_file():
                raise InputError(path, "no such results file", f"correct results and errors of dataset {name}")
        resolved[name] = of
    return resolved


def require_local(entry: Mapping) -> None:
    """Raise an InputError unless a resolved dataset that needs no download has scenes and, elsewhere, models."""
    if entry["origin"] == "local":
        next(scene_files([Path(entry["location"])], entry.get("split", "test")))
        if entry.get("models"):
            models_folder(Path(entry["models"]))


def has_estimates(datasets: Mapping[str, dict]) -> bool:
    """Return whether any of the resolved datasets has poses or pose errors of estimators."""
    return any(entry["results"] or entry["errors"] for entry in datasets.values())


def conditions_of(config: Mapping) -> dict[str, dict]:
    """Return the config's further initial poses, without those from results where no dataset has any."""
    section = config["real_world"]
    estimated = has_estimates(resolve_datasets(section["datasets"], config["data_dir"]))
    conditions = (section["conditions"] or {}).items()
    return {name: entry for name, entry in conditions if estimated or entry.get("form") != "results"}


def patterns(split: str = "test") -> list[str]:
    """Return the patterns of the files that are read of a dataset, below its folder."""
    return [f"{split}*/*/*.json", f"{split}*/*/depth/*", f"{split}*/*/mask_visib/*", "models/*"]


def frame_files(datasets: Mapping[str, dict], data_dir: str | None) -> list[Path]:
    """Return the files that local datasets are read from, sorted by dataset and name."""
    files = []
    for entry in resolve_datasets(datasets, data_dir).values():
        files += data_files(entry) + [Path(path) for path in (*entry["results"], entry["errors"]) if path]
        files += sorted(Path(entry["models"]).glob("models/*")) if entry.get("models") else []
    return files


def _matching(data_dir: str | None, name: str) -> list[Path]:
    """Return the files that a name with an asterisk matches, perhaps none, or the one that is named in full."""
    places = places_of(name, data_dir)
    if "*" not in name:
        return [next((path for path in places if path.is_file()), places[0])]
    return next((paths for path in places if (paths := sorted(path.parent.glob(path.name)))), [])
