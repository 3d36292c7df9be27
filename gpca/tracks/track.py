"""The tracks: what each asks, of which samples, and which numbers of a method it shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from gpca.causes.dataset import LABELS
from gpca.errors import require_known
from gpca.explainers.registry import CAUSES, CONCEPTS
from gpca.frames.source import REAL_WORLD
from gpca.pairs.perturbation import CONCEPTS as PERTURBATIONS

CAUSES_TRACK, HARD_TRACK, FRAMES_TRACK = ("causes", "hard", "frames")


@dataclass(frozen=True)
class Track:
    """A track.

    Attributes:
        name, title: of it.
        kind: of the explainers that are asked.
        labels: what they name, in the order of their scores.
        samples: pattern of the files of samples, below the folder of a run.
        sources: of the samples; none where they are those of the config.
        seeds: key of the config that says how many of its seeds there are samples of; none for all.
        headline: the measure by which methods are ranked, and compared pair by pair.
    """

    name: str
    title: str
    kind: str
    labels: tuple[str, ...]
    samples: str
    headline: str
    sources: tuple[str, ...] = ()
    seeds: str = ""

    def parts(self, config: Mapping[str, Any]) -> list[tuple[str, int]]:
        """Return the source and the seed of each file of samples, seed by seed."""
        count: Any = config
        for key in self.seeds.split(".") if self.seeds else ():
            count = count[key]
        seeds = list(config["seeds"])[: count if self.seeds else None]
        return [(source, seed) for seed, source in product(seeds, self.sources or config["sources"])]

    def file(self, source: str, seed: int) -> str:
        """Return the path of a file of samples below the folder of a run, or of a cache."""
        return self.samples.format(source=source, seed=seed)


TRACKS = {
    track.name: track
    for track in (
        Track(
            CAUSES_TRACK,
            "What is wrong with a registration, if anything",
            CAUSES,
            LABELS,
            "causes/{source}/seed{seed}.npz",
            "balanced_accuracy",
        ),
        Track(
            HARD_TRACK,
            "Which perturbation of several adds most to the error",
            CONCEPTS,
            PERTURBATIONS,
            "hard/{source}/seed{seed}.npz",
            "accuracy",
            seeds="controls.seeds",
        ),
        Track(
            FRAMES_TRACK,
            "What is wrong with registrations of depth frames; learned from simulated causes",
            CAUSES,
            LABELS,
            "frame_causes/seed{seed}.npz",
            "state_accuracy",
            sources=(REAL_WORLD,),
            seeds="real_world.causes.seeds",
        ),
    )
}


def track_of(name: str) -> Track:
    """Return the track of that name; an unknown one raises an InputError that lists the known."""
    require_known("track", name, TRACKS)
    return TRACKS[name]
