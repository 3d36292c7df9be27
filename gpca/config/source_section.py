"""The section ``sources`` of the config: where objects come from (docs/adding.md)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from gpca.settings import Bounds, Count

NAME = {"pattern": "^[a-z][a-z0-9_]*$", "maxLength": 100}  # of what gets files of its own
Place = Annotated[str, Bounds(minLength=1)]
Pattern = Annotated[str, Bounds(minLength=1)]
Unit = Literal["m", "cm", "mm"]
Url = Annotated[str, Bounds(pattern=r"^https?://\S+$")]
Urls = list[Url]
Sha256 = Annotated[str, Bounds(pattern="^[0-9a-f]{64}$")]
ManySha256 = Annotated[list[Sha256 | None], Bounds(minItems=0)]
Checksums = Sha256 | ManySha256 | None
# A source within a source: its schema stands once, under $defs.
Local = Annotated[dict, Bounds(**{"$ref": "#/$defs/source"})]


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
        local: keys that override the others where its own data is found below `data_dir`.
    """

    title: Annotated[str, Bounds(minLength=1)] = ""
    kind: str = ""
    family: str = ""
    location: Place | None = None
    files: list[Pattern] = field(default_factory=list)
    objects: Annotated[list[Annotated[int, Bounds(minimum=0)]], Bounds(uniqueItems=True)] = field(default_factory=list)
    unit: Unit = "m"
    url: Url = ""
    urls: Urls = field(default_factory=list)
    sha256: Checksums = None
    views_per_instance: Count = 1
    stand_in: bool = False
    local: Local = field(default_factory=dict)
