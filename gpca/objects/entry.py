"""A source's entry in the config: where its objects come from (docs/adding.md)."""

from __future__ import annotations

from dataclasses import dataclass, field
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


@dataclass(frozen=True)
class Source:
    """A source of objects: one row in every table.

    Attributes:
        title: as tables name the row.
        kind: how the data is read.
        family: of procedural objects.
        location, files: the folder, relative to `data_dir`, and patterns below it.
        objects: numbers of objects; all where left out.
        unit: of lengths in the files.
        url, urls, sha256: what is downloaded where the location is not there.
        views_per_instance: at most so many single views of one instance.
        stand_in: every title says that the objects are stand-ins.
    """

    title: Text = ""
    kind: str = ""
    family: str = ""
    location: Place | None = None
    files: Annotated[list[Text], Field(min_length=1)] = field(default_factory=list)
    objects: Distinct[Annotated[int, Bounds(minimum=0)]] = ()
    unit: Unit | None = None
    url: Url = ""
    urls: Urls = field(default_factory=list)
    sha256: Checksums = None
    views_per_instance: Count = 1
    stand_in: bool = False


@dataclass(frozen=True, kw_only=True)
class NamedSource(Source):
    """A source of the config, with a title and a kind."""

    title: Text = field()
    kind: str = field()

    def __post_init__(self) -> None:
        if self.kind == "mesh_folder" and not self.unit:
            raise InputError("unit", "is missing", "say what the lengths in its files are in: m, cm or mm")
