"""Step ``draw_scans``: a data set of scans -> pairs of each scene and stratum of overlap, with their true poses."""

from __future__ import annotations

from pathlib import Path

from gpca.errors import InputError
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.scans.dataset import ScanPairs
from gpca.scans.selection import choose_pairs
from gpca.scans.source import entry_of, scenes_of


def run(job: Job) -> None:
    """Read or make the scenes, and draw their pairs."""
    entry, choice = entry_of(job.section("entry")), job.section("choice")
    place = Path(job.place) if job.get("place") else None
    with record_provenance([job.out], job.get("data", []), job.settings, seed=job.seed):
        scenes = scenes_of(entry, place, job.settings["role"], choice["scan_points"])
        pairs = choose_pairs(scenes, choice["strata"], choice["pairs"], job.source, job.seed)
        if not pairs:
            fault = f"has no two scans that overlap by {choice['strata'][0]:g} or more"
            raise InputError(place or entry.title, fault, "check its poses and its unit")
        ScanPairs.of(pairs).save(job.out, (job.source, job.seed))
