"""The tracks: what each asks, of which samples, and which numbers of a method it shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from gpca.causes.dataset import LABELS
from gpca.causes.truth import NOMINAL
from gpca.code_files import ROOT
from gpca.errors import InputError, require_known
from gpca.experiments.scan_causes.settings import OBJECTS, SCANS
from gpca.explainers.registry import CAUSES, CONCEPTS
from gpca.frames.source import REAL_WORLD
from gpca.pairs.perturbation import CONCEPTS as PERTURBATIONS

CAUSES_TRACK, HARD_TRACK, FRAMES_TRACK, SCANS_TRACK = ("causes", "hard", "frames", "scans")
DEFAULT = "default"  # run
READS = ("descriptors/{source}/seed{seed}.npz", "reenactments/{source}/seed{seed}.npz")
LESSONS = ("causes", "descriptors", "reenactments")
OF_TABLE_9 = "The measures are those of Table IX (docs/causes.md); the last row has counterfactual access."


@dataclass(frozen=True)
class Track:
    """A track.

    Attributes:
        name, title: of it.
        kind: of the explainers that are asked.
        labels: what they name, in the order of their scores.
        samples: pattern of the files of samples, below the folder of a run.
        headline: the measure by which methods are ranked, and compared pair by pair.
        sources: of the samples; none where they are those of the config,
        listed: at this key.
        everywhere: sources that everyone has, where others need data that not everyone has; none where all are such.
        seeds: key of the config that says how many of its seeds there are samples of; none for all.
        run: that the samples are of: ``default``, or the name of a config that is laid over the default one.
        said: pattern of the files of predictions in a run, where one holds those of all methods.
        labeled_by: columns that say of which such a row is.
        read: patterns of the files that methods may read, beside those of the samples.
        lessons: folders of what they learn from objects, of every source.
        learn_from: where a method may learn, if there is a choice; the first is the usual one.
        untaught: what to learn from, where all samples are for testing.
        groups: head of the column of the groups of samples that are each scored by themselves; empty for one group.
        enough_of: states of which a group needs many samples, or nothing is concluded.
        draws: what names the bootstrap's draws, as in the table of a run that has the same rows.
        clusters: what these are over.
        measures: what is said of the measures below a table.
    """

    name: str
    title: str
    kind: str
    labels: tuple[str, ...]
    samples: str
    headline: str
    draws: str
    clusters: str
    measures: str
    sources: tuple[str, ...] = ()
    listed: str = "sources"
    everywhere: tuple[str, ...] = ()
    seeds: str = ""
    run: str = DEFAULT
    said: str = ""
    labeled_by: tuple[str, ...] = ()
    read: tuple[str, ...] = ()
    lessons: tuple[str, ...] = ()
    learn_from: tuple[str, ...] = ()
    untaught: str = ""
    groups: str = ""
    enough_of: tuple[str, ...] = ("failed",)

    def parts(self, config: Mapping[str, Any]) -> list[tuple[str, int]]:
        """Return the source and the seed of each file of samples, seed by seed."""
        seeds = list(config["seeds"])[: _at(config, self.seeds) if self.seeds else None]
        return [(source, seed) for seed, source in product(seeds, self.sources or _at(config, self.listed))]

    @property
    def layers(self) -> list[Path]:
        """The configs that are laid over the default one."""
        return [] if self.run == DEFAULT else [ROOT / "config" / f"{self.run}.yaml"]

    def may_lack(self, source: str) -> bool:
        """Whether somebody who does not have a source's data can do without its samples."""
        return bool(self.everywhere) and source not in self.everywhere

    def lesson(self, asked: str | None) -> str:
        """Return where a method is to learn: what was asked for, or the usual; empty where there is no choice.

        Raises:
            InputError: the track does not have it.
        """
        if asked is not None and not self.learn_from:
            raise InputError("--learn-from", f"is no choice on the track {self.name}", "leave it out")
        if asked is not None:
            require_known("--learn-from", asked, self.learn_from)
        return asked or next(iter(self.learn_from), "")

    def file(self, source: str, seed: int) -> str:
        """Return the path of a file of samples below the folder of a run, or of a cache."""
        return self.samples.format(source=source, seed=seed)

    def with_lesson(self, text: str, lesson: str) -> str:
        """Return the name or title of a method with where it learned, unless that is the usual."""
        return text if lesson in ("", *self.learn_from[:1]) else f"{text} (from {lesson})"


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
            draws="cause intervals",
            clusters="families of objects and seeds",
            measures=OF_TABLE_9,
            read=READS,
        ),
        Track(
            HARD_TRACK,
            "Which perturbation of several adds most to the error",
            CONCEPTS,
            PERTURBATIONS,
            "hard/{source}/seed{seed}.npz",
            "accuracy",
            draws="control intervals",
            clusters="families of objects and seeds",
            measures="AUROC of errors: how well the entropy of the scores tells wrong answers from right ones.",
            seeds="controls.seeds",
            said="controls/{source}/seed{seed}.csv",
            labeled_by=("control", "tested", "explainer"),
        ),
        Track(
            FRAMES_TRACK,
            "What is wrong with registrations of depth frames; learned from simulated causes",
            CAUSES,
            LABELS,
            "frame_causes/seed{seed}.npz",
            "state_accuracy",
            draws="frame cause intervals",
            clusters="scenes",
            measures=OF_TABLE_9,
            sources=(REAL_WORLD,),
            seeds="real_world.causes.seeds",
            said="frame_diagnoses/seed{seed}.csv",
            labeled_by=("explainer",),
            read=READS[1:],
            lessons=LESSONS,
            untaught="learn from the track causes",
            groups="Starts",
        ),
        Track(
            SCANS_TRACK,
            "What is wrong with registrations of scans to scans",
            CAUSES,
            LABELS,
            "scan_causes/{source}/seed{seed}.npz",
            "auroc_failed",
            draws="scan cause intervals",
            clusters="scenes",
            measures="The measures are those of Table XVIII (docs/scans.md), of registrations to which no noise was "
            "added; the last row has counterfactual access.",
            listed="scans.datasets",
            everywhere=("virtual_scans",),
            seeds="scans.seeds",
            run="full",
            said="scan_diagnoses/seed{seed}.csv",
            labeled_by=("scans", "learned", "explainer"),
            read=("scan_descriptors/{source}/seed{seed}.npz", "scan_reenactments/{source}/seed{seed}.npz"),
            lessons=LESSONS,
            learn_from=(SCANS, OBJECTS),
            untaught="learn from the samples of other scenes, which registrations.cluster names",
            groups="Scans",
            enough_of=("failed", NOMINAL),
        ),
    )
}


def track_of(name: str) -> Track:
    """Return the track of that name; an unknown one raises an InputError that lists the known."""
    require_known("track", name, TRACKS)
    return TRACKS[name]


def _at(config: Mapping[str, Any], key: str) -> Any:
    value: Any = config
    for name in key.split("."):
        value = value[name]
    return value
