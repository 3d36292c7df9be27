"""Where configured datasets of frames are: in a local folder, or at the addresses that they are downloaded from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gpca.errors import InputError
from gpca.objects.source import data_files, resolve

REAL_WORLD = "real_rgbd"  # the source that the frames of a run are


def resolve_datasets(datasets: Mapping[str, dict] | None, data_dir: str | None) -> dict[str, dict]:
    """Return the resolved entries of the config's section ``real_world.datasets``; reads no data.

    Raises:
        InputError: as :func:`gpca.objects.source.resolve` raises it, and for a results file that is not there.
    """
    return {name: _resolved(name, entry, data_dir) for name, entry in (datasets or {}).items()}


def patterns(split: str = "test") -> list[str]:
    """Return the patterns of the files that are read of a dataset, below its folder."""
    return [f"{split}*/*/*.json", f"{split}*/*/depth/*", f"{split}*/*/mask_visib/*", "models/*"]


def frame_files(datasets: Mapping[str, dict], data_dir: str | None) -> list[Path]:
    """Return the files that local datasets are read from, sorted by dataset and name."""
    files = []
    for entry in resolve_datasets(datasets, data_dir).values():
        files += data_files(entry) + ([Path(entry["results"])] if entry.get("results") else [])
    return files


def _resolved(name: str, entry: dict, data_dir: str | None) -> dict:
    found = resolve({"title": name, "kind": "bop", "files": patterns(entry.get("split", "test")), **entry}, data_dir)
    if found.get("results"):
        found["results"] = str(Path(data_dir or "", found["results"]).expanduser().absolute())
        if not Path(found["results"]).is_file():
            raise InputError(found["results"], "no such results file", f"correct results of dataset {name}")
    return found
