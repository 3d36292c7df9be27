"""Settings of the scans: nothing here needs the code that registers them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field

from gpca.errors import InputError
from gpca.objects.entry import Name
from gpca.scans.pair import Rung, ScanSuccess
from gpca.scans.source import ScanEntry
from gpca.settings import Bounds, Count, Distinct, Share, fields_of, read_settings


@dataclass(frozen=True, kw_only=True)
class ChoiceSettings:
    """Which pairs of scans there are.

    Attributes:
        strata: edges of the strata of overlap, ascending.
        pairs: of each scene, stratum and seed, at most.
        scan_points: larger scans are thinned to so many points, drawn at random.
    """

    strata: Annotated[tuple[Share, ...], Field(min_length=2)] = (0.1, 0.3, 0.5, 0.7, 1.0)
    pairs: Count = 2
    scan_points: Annotated[int, Bounds(minimum=100)] = 20000

    def __post_init__(self) -> None:
        if sorted(set(self.strata)) != list(self.strata):
            raise InputError("strata", f"{list(self.strata)} is not in ascending order", "sort the edges")


@dataclass(frozen=True, kw_only=True)
class TrialSettings:
    """How the pairs are registered. Meters are those of a room: objects are enlarged to the size of a fragment of one.

    Attributes:
        voxel_m: both scans are thinned to the mean of the points in each voxel,
        points: and then to so many at most, drawn at random.
        ladder: disturbances of the true pose from which local methods start: a pair starts on one rung.
        global_start: the global method at whose pose local methods start a second time.
    """

    voxel_m: Annotated[float, Bounds(exclusiveMinimum=0, maximum=1)] = 0.05
    points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 5000
    ladder: Distinct[Rung] = (Rung(0, 0),)
    global_start: str = "fgr"


@dataclass(frozen=True, kw_only=True)
class ScanSettings(ChoiceSettings, TrialSettings):
    """The section ``scans`` of the config.

    Attributes:
        seeds: how many of the run's seeds, from the first; each draws other pairs and starts.
        datasets: by name.
        success: when a registration is correct.
        methods: settings of registration methods on scans, instead of those that ``methods`` has.
    """

    datasets: Annotated[dict[Name, ScanEntry], Field(min_length=1)]
    seeds: Count = 1
    success: ScanSuccess = field(default_factory=ScanSuccess)
    methods: dict[str, dict | None] = field(default_factory=dict)


def part(kind: type, section: Mapping[str, Any]) -> Any:
    """Return those settings of the section that are of one of its bases."""
    return read_settings(kind, fields_of(section, kind))
