"""What the track of scans asks: the experiment's own step, of one method, on the data sets that somebody has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import TYPE_CHECKING, Any

from gpca.attribution.predictions import read_predictions
from gpca.experiments.scan_causes import diagnosis_step
from gpca.experiments.scan_causes.diagnosis_step import DESCRIBED, EMBEDDED
from gpca.experiments.scan_causes.experiment import diagnosis_settings
from gpca.experiments.scan_causes.settings import OBJECTS
from gpca.explainers.interface import REENACTED, ExplainerEntry
from gpca.process.job import Job
from gpca.tracks.samples import Samples

if TYPE_CHECKING:
    import pandas as pd

FOLDER_OF = {REENACTED: "reenactments", EMBEDDED: "cause_embeddings", DESCRIBED: "descriptors"}  # of what is read


@dataclass(frozen=True)
class Said:
    """What a method said of the scans of all data sets of a seed.

    Attributes:
        by_set: rows of predictions, by the data set.
        seconds: of learning and explaining, for each registration.
    """

    by_set: Mapping[str, pd.DataFrame]
    seconds: float


def ask(
    samples: Samples,
    name: str,
    entry: ExplainerEntry,
    settings: Mapping[str, Any],
    learned: str,
    seed: int,
    sets: Sequence[str],
) -> Said:
    """Return what a method says, for which it learns from all scenes but those of the fold that it is asked about.

    Args:
        settings: of the method.
        learned: ``scans``, or ``objects``: from the registrations of objects alone.
        sets: data sets whose scenes are asked about, and learned from.

    Raises:
        InputError: samples that cannot be made, or nothing that could be learned from.
    """
    files = {
        kind: samples.files(f"{kind}/{each}/seed{seed}.npz" for each in sets)
        for kind in ("scan_causes", "scan_descriptors", "scan_reenactments")
    }
    with TemporaryDirectory() as folder:
        job = Job(
            source="scans",
            seed=seed,
            settings=diagnosis_settings(samples.config, {name: [learned]}, {name: dict(settings)}),
            predictions=Path(folder) / f"seed{seed}.csv",
            **files,
            **_lessons(samples, entry, learned, seed),
        )
        started = perf_counter()
        diagnosis_step.run(job)
        seconds = perf_counter() - started
        rows = read_predictions(job.predictions, labels=samples.track.labeled_by)
    return Said({each: rows[rows["scans"] == each] for each in sets}, seconds / len(rows))


def _lessons(samples: Samples, entry: ExplainerEntry, learned: str, seed: int) -> dict[str, list[Path]]:
    """Return files of all sources of objects: of their causes and what the method reads, and encoders of embeddings."""
    folders: dict[str, tuple[str, str]] = {}
    if learned == OBJECTS:
        reads = entry.reads if entry.reads in FOLDER_OF else DESCRIBED
        folders |= {"causes": ("causes", "npz"), reads: (FOLDER_OF[reads], "npz")}
    if entry.reads == EMBEDDED:
        folders |= {"encoders": ("cause_encoders", "pt")}
    sources = samples.config["sources"]
    return {
        kind: samples.files(f"{folder}/{source}/seed{seed}.{suffix}" for source in sources)
        for kind, (folder, suffix) in folders.items()
    }
