"""A run as its tables and steps see it: the config, the sources, and the names in the paths of its files.

A table that is given a run records which keys of the config it read. As long as these have the same values, it is not
made again, whatever else in the config changes.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from gpca.jobs.provenance import sha256_of_settings
from gpca.objects.entry import dataset_of, stand_in_clause, title_of

KEYS = "*"  # at the end of a path: the keys of a mapping, whatever their values
READ = "config_read"  # in the provenance of a result


class Run:
    """A run, of a config that :func:`gpca.config.check.check` has checked."""

    def __init__(
        self,
        config: Mapping[str, Any],
        only: Mapping[str, Iterable[str]] | None = None,  # section -> entries of it that are shown
        # Function of config and sources that returns the names in the braces of paths.
        names_of: Callable[[Mapping, Mapping], dict[str, Any]] = lambda config, sources: {},
    ) -> None:
        self.config = config
        self._names_of = names_of
        self._only = {f"{name}s": tuple(entries) for name, entries in (only or {}).items()}

    def section(self, name: str) -> dict[str, Any]:
        """Entries of a section of the config, or those of them that are shown."""
        entries = self.config[name]
        return {key: entries[key] for key in self._only.get(name, entries) if key in entries}

    @cached_property
    def sources(self) -> dict[str, dict[str, Any]]:
        """Name -> title, and whether it is a stand-in."""
        return {
            name: {
                "title": entry["title"],
                "stand_in": entry["stand_in"] if "stand_in" in entry else entry["kind"] == "procedural",
            }
            for name, entry in self.config["sources"].items()
        }

    @cached_property
    def source_titles(self) -> dict[str, str]:
        """Name -> title, which says so where the source is a stand-in."""
        return {name: title_of(entry) for name, entry in self.sources.items()}

    @cached_property
    def datasets(self) -> dict[str, str]:
        """Name of a source -> name of its dataset in the BOP benchmark; empty for other kinds of source."""
        return {name: dataset_of(entry) for name, entry in self.config["sources"].items()}

    @cached_property
    def names(self) -> dict[str, Any]:
        """Names in the braces of paths; reading them reads most of the config."""
        return self._names_of(self.config, self.sources)

    def titles(self, entry: Callable[[str], Any], names: Iterable[str]) -> dict[str, str]:
        """Name -> title, given the function that returns the entry of a name, such as ``method_entry``."""
        return {name: entry(name).title for name in names}

    def stand_ins(self, names: Iterable[str] | None = None) -> str:
        """Clause of a caption on stand-ins among these sources, or among all."""
        return stand_in_clause(self.sources[name] for name in (self.sources if names is None else names))

    def seeds(self, most: int | None = None) -> list[int]:
        """Seeds of the run, or the first of them."""
        return list(self.config["seeds"])[:most]


class Recorded(Mapping):
    """A mapping of a config that records which of its values are read, by path."""

    def __init__(self, values: Mapping[str, Any], read: dict[str, Any] | None = None, path: str = "") -> None:
        self._values, self._path = values, path
        self.read: dict[str, Any] = {} if read is None else read

    def __getitem__(self, key: str) -> Any:
        path = f"{self._path}{key}"
        if key not in self._values:
            self.read[path] = None
            raise KeyError(key)
        value = self._values[key]
        if isinstance(value, Mapping):
            return Recorded(value, self.read, f"{path}.")
        self.read[path] = value
        return value

    def __iter__(self) -> Iterator[str]:
        self.read[f"{self._path}{KEYS}"] = list(self._values)
        return iter(self._values)

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __or__(self, other: Mapping) -> dict[str, Any]:
        return dict(self) | dict(other)

    def __ror__(self, other: Mapping) -> dict[str, Any]:
        return dict(other) | dict(self)

    def record(self, token: str) -> dict[str, Any]:
        """What the provenance of a result keeps: its token, and the hashes of the values that were read."""
        return {"token": token, "keys": {path: sha256_of_settings(value) for path, value in sorted(self.read.items())}}


def plain(values: Any) -> Any:
    """Mapping, and those in it, as dictionaries, of which all values count as read."""
    return {key: plain(value) for key, value in values.items()} if isinstance(values, Mapping) else values


def config_token(config: Mapping[str, Any], sidecar: str | Path) -> str:
    """Text that changes when a value changes that the result with this provenance has read.

    It is the token that is recorded there while those values are the same, and the hash of the whole config otherwise.
    """
    try:
        recorded = json.loads(Path(sidecar).read_text(encoding="utf-8"))[READ]
        keys = recorded["keys"].items()
        if all(sha256_of_settings(_value_at(config, path)) == before for path, before in keys):
            return recorded["token"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        pass
    return sha256_of_settings(config)


def _value_at(config: Any, path: str) -> Any:
    for key in path.split("."):
        if key == KEYS:
            return list(config)
        if not isinstance(config, Mapping) or key not in config:
            return None
        config = config[key]
    return config
