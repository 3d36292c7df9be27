"""The origin of a model: the data of its run with their licenses, by the run's provenance."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from gpca.errors import InputError
from gpca.io.structured_text import load_own_yaml, read_json
from gpca.objects.canonical import ObjectClouds

LICENSES = Path(__file__).with_name("licenses.yaml")
REMEDY = "ship a model from the folder of the run that made it"
_READ = re.compile(r"/(model_causes|registrations)/([^/]+)/seed\d+\.npz$")  # among the inputs of a model


@dataclass(frozen=True)
class License:
    """The license of a dataset, as far as it is known.

    Attributes:
        dataset, license: their names.
        known: where the license was read.
    """

    dataset: str
    license: str
    known: str


@dataclass(frozen=True)
class Source:
    """Objects that a model learned.

    Attributes:
        name, title: in the run.
        diagnosed: whether the diagnosis learned from them, or else GP-CA.
        objects: how many there are.
        licenses: of all datasets that they were read from.
    """

    name: str
    title: str
    diagnosed: bool
    objects: int
    licenses: tuple[License, ...]


@dataclass(frozen=True)
class Origin:
    """How a model was made.

    Attributes:
        record: its provenance, as :func:`gpca.process.provenance.record_provenance` wrote it.
        sources: those that it learned from, in the order of the record.
    """

    record: Mapping
    sources: tuple[Source, ...]

    @classmethod
    def of(cls, model: Path, title: str) -> Origin:
        """Return the origin of a model file in the folder of its run.

        Args:
            model: the file, with its provenance beside it and the objects of the run below ``objects/``.
            title: of the frames, which the provenance of a dataset's objects does not name.

        Raises:
            InputError: provenance that is missing or incomplete, objects drawn by the package, data without a license.
        """
        record = _provenance(model)
        learned_from = [match.groups() for path in record["inputs_sha256"] if (match := _READ.search(f"/{path}"))]
        if not learned_from:
            raise InputError(_beside(model), "lists nothing that a model learns from", REMEDY)
        sources = (_source(model.parent, name, kind == "model_causes", title) for kind, name in learned_from)
        try:
            return cls(record, tuple(sources))
        except (LookupError, TypeError, AttributeError) as fault:
            raise InputError(model.parent / "objects", f"its provenance is incomplete ({fault})", REMEDY) from fault


def _source(run: Path, name: str, diagnosed: bool, title: str) -> Source:
    objects = run / "objects" / f"{name}.npz"
    record = _provenance(objects)
    settings = record["settings"]
    entry = settings.get("entry", {"title": title, "stand_in": "datasets" not in settings})
    if entry.get("stand_in"):
        raise InputError(objects, "contains objects that the package drew", "ship a model of real objects")
    places = list(record["inputs_sha256"]) or _addresses(settings)
    licenses = {license: None for place in places for license in licenses_of(place, objects)}
    return Source(name, entry["title"], diagnosed, len(ObjectClouds.load(objects)), tuple(licenses))


def _addresses(settings: Mapping) -> list[str]:
    """Return the addresses of the downloads."""
    entries = settings["datasets"].values() if "datasets" in settings else [settings["entry"]]
    return [url for entry in entries for url in (entry.get("urls") or [entry["url"]])]


def licenses_of(place: str, objects: Path) -> list[License]:
    """Return the licenses of the datasets that a file or an address is of.

    Raises:
        InputError: none is known; the line names `objects`, which were made from it.
    """
    known = [license for words, license in _licenses() if any(word in place for word in words)]
    if not known:
        fault = f"was made from '{Path(place).name}', which is from a dataset without a known license"
        raise InputError(objects, fault, f"add the dataset to {LICENSES}")
    return known


@cache
def _licenses() -> tuple[tuple[tuple[str, ...], License], ...]:
    return tuple(
        (tuple(entry["found"]), License(dataset, entry["license"], entry["known"]))
        for dataset, entry in load_own_yaml(LICENSES).items()
    )


def _beside(path: Path) -> Path:
    return path.with_name(path.name + ".provenance.json")


def _provenance(path: Path) -> dict:
    """Return the record beside a file."""
    record = read_json(_beside(path), "a provenance record", REMEDY)
    for name in ("inputs_sha256", "settings", "code"):
        if not isinstance(record.get(name), dict):
            raise InputError(_beside(path), f"lacks '{name}'", REMEDY)
    return record
