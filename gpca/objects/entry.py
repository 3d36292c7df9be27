"""A source's entry in the config (docs/adding.md), and how titles show it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Annotated, Literal

from pydantic import Field

from gpca.errors import InputError
from gpca.settings import Bounds, Count, Distinct

Name = Annotated[str, Field(pattern="^[a-z][a-z0-9_]*$", max_length=100)]  # of what gets files of its own
Text = Annotated[str, Field(min_length=1)]
Place = Text
Unit = Literal["m", "cm", "mm"]
Url = Annotated[str, Field(pattern=r"^https?://\S+$")]
Urls = Annotated[list[Url], Field(min_length=1)]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Checksums = Sha256 | list[Sha256 | None] | None
SurfacePoints = Annotated[int, Bounds(minimum=256, maximum=1048576)]  # sampled on each mesh


@dataclass(frozen=True, kw_only=True)
class SourceEntry:
    """A source of objects: one row in every table."""

    title: Text
    kind: str  # how the data is read
    family: str = ""  # of procedural objects
    location: Place | None = None  # a folder, relative to `data_dir`
    files: Annotated[list[Text], Field(min_length=1)] = field(default_factory=list)  # patterns below it
    objects: Distinct[Annotated[int, Bounds(minimum=0)]] = ()  # their numbers; all if empty
    unit: Unit | None = None  # of lengths in the files
    url: Url = ""  # of the download, where the location does not exist
    urls: Urls = field(default_factory=list)  # several of them
    sha256: Checksums = None
    views_per_instance: Count = 1  # at most, of single views
    stand_in: bool = False  # every title says that the objects are stand-ins

    def __post_init__(self) -> None:
        if self.kind == "mesh_folder" and not self.unit:
            raise InputError("unit", "is missing", "say what the lengths in its files are in: m, cm or mm")


STAND_IN = "procedural stand-in"


def title_of(entry: Mapping) -> str:
    """Return a source's title; a stand-in always says that it is one."""
    return f"{entry['title']} ({STAND_IN})" if entry["stand_in"] else entry["title"]


def dataset_of(entry: Mapping) -> str:
    """Return the BOP benchmark's name of a source's dataset; empty for other kinds of source."""
    return PurePath(entry.get("location") or "").name if entry.get("kind") == "bop" else ""


def stand_in_clause(entries: Iterable[Mapping]) -> str:
    """Return the clause that ends a caption when a source is a stand-in, with "partly" for a mixture."""
    stand_ins = [bool(entry["stand_in"]) for entry in entries]
    if not any(stand_ins):
        return ""
    return f", measured {'' if all(stand_ins) else 'partly '}on {STAND_IN}s for the datasets' objects"
