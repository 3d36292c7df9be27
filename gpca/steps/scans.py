"""The step that draws pairs of scans."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gpca.errors import InputError
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance

if TYPE_CHECKING:
    from gpca.scans.pair import ScanPair


def draw_scans(job: Job) -> None:
    """Read or make the scenes of a data set of scans and draw pairs of each scene and stratum of overlap."""
    from gpca.scans.scene import ScanPairs

    with record_provenance([job.out], job.get("data", []), job.settings, seed=job.seed):
        ScanPairs.of(drawn_pairs(job, job.section("choice"))).save(job.out, (job.source, job.seed))


def drawn_pairs(job: Job, choice: Mapping[str, Any]) -> list[ScanPair]:
    """Pairs of the data set that a job names by its entry, place and role.

    The choice has the edges of the strata, and pairs of each scene and stratum and points of a scan, at most.
    """
    from gpca.scans.scene import choose_pairs
    from gpca.scans.source import entry_of, scenes_of

    entry, place = entry_of(job.section("entry")), Path(job.place) if job.get("place") else None
    scenes = scenes_of(entry, place, job.settings["role"], choice["scan_points"])
    pairs = choose_pairs(scenes, choice["strata"], choice["pairs"], job.source, job.seed)
    if not pairs:
        fault = f"has no two scans that overlap by {choice['strata'][0]:g} or more"
        raise InputError(place or entry.title, fault, "check its poses and its unit")
    return pairs
