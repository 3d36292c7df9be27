"""Checks of where things lie: the run's own folder, data, downloads. None of them reads data."""

from __future__ import annotations

from gpca.errors import InputError, with_key
from gpca.objects.source import require_place

# Folders of results/ that no run may take: reference runs are kept in one, logs beside all runs in the other.
TAKEN = ("reference", "logs")


def check_places(config: dict) -> None:
    """Check the run's name, and the folders that data comes from and downloads go to."""
    if config["run"].lower() in TAKEN:
        raise InputError("config key run", f"results/{config['run']} is reserved", "choose another name")
    if config["data_dir"] is not None:
        with_key("data_dir", require_place, config["data_dir"])
    folder = with_key("downloads", require_place, config["downloads"])
    existing = next((path for path in (folder, *folder.parents) if path.exists()), folder)
    if not existing.is_dir():
        raise InputError("config key downloads", f"{existing} is not a folder", "name a folder; it need not exist")
