"""The tracks: question, samples and headline measure of each."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import product
from operator import getitem
from typing import Any

from gpca.causes.dataset import LABELS
from gpca.causes.settings import OBJECTS, SCANS
from gpca.causes.truth import NOMINAL
from gpca.errors import require_known
from gpca.explainers.registry import CAUSES, CONCEPTS
from gpca.frames.source import REAL_WORLD
from gpca.pairs.perturbation import CONCEPTS as PERTURBATIONS
from gpca.process.code_files import ROOT

CAUSES_TRACK, HARD_TRACK, FRAMES_TRACK, SCANS_TRACK = ("causes", "hard", "frames", "scans")
DEFAULT = "default"  # run
READS = ("descriptors/{source}/seed{seed}.npz", "reenactments/{source}/seed{seed}.npz")
LIKE_TABLE_9 = "The measures are those of Table IX (docs/causes.md); the last row has counterfactual access."


@dataclass(frozen=True)
class Track:
    """A track; patterns of files are below the folder of a run."""

    name: str
    title: str
    kind: str  # of its explainers
    labels: tuple[str, ...]  # in the order of the scores
    samples: str  # pattern of the files of samples
    headline: str  # the measure that ranks methods and is compared pair by pair
    draws: str  # name of the bootstrap's random numbers, as in the table of the run's results
    clusters: str  # what the bootstrap resamples, in words
    measures: str  # footnote about the measures
    sources: tuple[str, ...] = ()  # of the samples; by default those at the config's key `listed`
    listed: str = "sources"
    everywhere: tuple[str, ...] = ()  # sources that everyone has, if the others need further data
    seeds: str = ""  # key of the config that limits the number of seeds
    run: str = DEFAULT  # of the samples: or the name of a config that overrides the default one
    predictions: str = ""  # pattern of a run's files of predictions, where one holds all methods
    labeled_by: tuple[str, ...] = ()  # the identifying columns of that file
    read: tuple[str, ...] = ()  # patterns of further files that methods may read
    training_folders: tuple[str, ...] = ()  # files of objects that methods learn from
    learn_from: tuple[str, ...] = ()  # training data of published methods, that without a mark first
    without_training: str = ""  # what to learn from, where all samples are for testing
    groups: str = ""  # column head of the groups of samples that are scored separately; empty for one group
    required_states: tuple[str, ...] = ("failed",)  # nothing is concluded from a group with few of one of them

    def parts(self, config: Mapping[str, Any]) -> list[tuple[str, int]]:
        """Return the source and the seed of each file of samples, seed by seed."""

        def entry(key: str) -> Any:
            return reduce(getitem, key.split("."), config)

        seeds = list(config["seeds"])[: entry(self.seeds) if self.seeds else None]
        return [(source, seed) for seed, source in product(seeds, self.sources or entry(self.listed))]

    def config(self, **local: Any) -> dict[str, Any]:
        """Return the config of the run that the samples are of, with these keys of this machine."""
        from gpca.config.check import read
        from gpca.config.layers import read_file, with_defaults

        layers = [] if self.run == DEFAULT else [read_file(ROOT / "config" / f"{self.run}.yaml")]
        return read(with_defaults(*layers, local), {})[0]

    def may_lack(self, source: str) -> bool:
        """Return whether the samples of a source may be left out, as its data has to be obtained."""
        return bool(self.everywhere) and source not in self.everywhere

    def file(self, source: str, seed: int) -> str:
        """Return the path of a file of samples below the folder of a run or a cache."""
        return self.samples.format(source=source, seed=seed)


_TRACKS = (
    Track(
        CAUSES_TRACK,
        "What is wrong with a registration, if anything",
        CAUSES,
        LABELS,
        "causes/{source}/seed{seed}.npz",
        "balanced_accuracy",
        draws="cause intervals",
        clusters="families of objects and seeds",
        measures=LIKE_TABLE_9,
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
        listed="controls.hard_sources",
        clusters="families of objects and seeds",
        measures="AUROC of errors: how well the entropy of the scores tells wrong answers from right ones.",
        seeds="controls.seeds",
        predictions="controls/{source}/seed{seed}.csv",
        labeled_by=("control", "tested", "explainer"),
        read=("hard_reenactments/{source}/seed{seed}.npz",),
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
        measures=LIKE_TABLE_9,
        sources=(REAL_WORLD,),
        seeds="real_world.causes.seeds",
        predictions="frame_diagnoses/seed{seed}.csv",
        labeled_by=("explainer",),
        read=READS[1:],
        training_folders=("causes", "descriptors", "reenactments"),
        without_training="learn from the track causes",
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
        measures="The measures are those of Table XVIII (docs/real_world.md), of registrations to which no noise was "
        "added; the last row has counterfactual access.",
        listed="scans.datasets",
        everywhere=("virtual_scans",),
        seeds="scans.seeds",
        run="full",
        predictions="scan_diagnoses/seed{seed}.csv",
        labeled_by=("scans", "learned", "explainer"),
        read=("scan_descriptors/{source}/seed{seed}.npz", "scan_reenactments/{source}/seed{seed}.npz"),
        learn_from=(SCANS, OBJECTS),
        without_training="learn from the samples of other scenes, which registrations.cluster names",
        groups="Scans",
        required_states=("failed", NOMINAL),
    ),
)
TRACKS = {track.name: track for track in _TRACKS}


def track_of(name: str) -> Track:
    """Return the track of that name; an unknown one raises an InputError."""
    require_known("track", name, TRACKS)
    return TRACKS[name]
