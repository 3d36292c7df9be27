"""A data set's entry in the config: where its scans come from (docs/scans.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from gpca.errors import InputError
from gpca.objects.entry import Place, Text, Unit
from gpca.scans.pair import Kind
from gpca.settings import Bounds

ScanKind = Literal["virtual", "npz", "ply_folder", "threedmatch"]
Number = Annotated[int, Bounds(minimum=0, maximum=100)]


@dataclass(frozen=True, kw_only=True)
class ScanEntry:
    """A data set of scans: one row of each method in every table.

    Attributes:
        title: as tables name the rows.
        kind: how the data is read; ``virtual`` is made by the package.
        location: a file or a folder, relative to `data_dir` or to the repository's data.
        scenes: whether its scenes are rooms or objects; npz files may say so themselves.
        unit: of lengths in the files.
        optional: where there is no such location, a run does without it.
        sensor_at_origin: the sensor stood at the origin of each scan's frame, so that normals point there.
        development: scenes on which settings were chosen; other runs than those of development leave them out.
        families: family of a scene, by name, where several scenes are alike.
        benchmark: it is 3DMatch's, whose recalls others have published.
        address, license: where the data is found, and on which terms.
        rooms, objects, views: of virtual scenes, how many, and scans of each.
    """

    title: Text
    kind: ScanKind
    location: Place | None = None
    scenes: Kind | None = None
    unit: Unit = "m"
    optional: bool = False
    sensor_at_origin: bool = False
    development: tuple[Text, ...] = ()
    families: Mapping[str, Text] = field(default_factory=dict)
    benchmark: bool = False
    address: Text = ""
    license: Text = ""
    rooms: Number = 0
    objects: Number = 0
    views: Annotated[int, Bounds(minimum=2, maximum=100)] = 8

    def __post_init__(self) -> None:
        if self.kind == "virtual" and not self.rooms + self.objects:
            raise InputError("rooms", "there are neither rooms nor objects", "set rooms or objects above 0")
        if self.kind != "virtual" and not self.location:
            raise InputError("location", "is missing", "name the file or folder of the scans")

    @property
    def stand_in(self) -> bool:
        """Whether no sensor measured it."""
        return self.kind == "virtual"
