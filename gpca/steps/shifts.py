"""The steps of shifted truths: samples of one shift, what explainers read of them, and what they answer (Table IX)."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.icp import Method
from gpca.causes.dataset import Causes, labeled
from gpca.causes.descriptors import describe_all
from gpca.causes.drawing import draw_shifted
from gpca.causes.settings import CauseSettings, DescriptorSettings
from gpca.explainers.interface import REENACTED
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.reenactment.dataset import reenact_all
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import seed_of_file
from gpca.settings import read_settings
from gpca.steps.diagnosis import DESCRIBED, World, learned_files, with_what_it_reads

STANDARD = "standard"  # the truth that explainers learn
LABELS = ("shift", "source", "explainer")  # columns before those of predictions


@dataclass(frozen=True)
class Shift:
    """A truth other than the one that explainers learn."""

    title: str
    causes: dict[str, Any] = field(default_factory=dict)  # settings of `causes` that differ
    method: Method = "point_to_point"

    def truth(self, causes: dict[str, Any], icp: dict[str, Any]) -> CauseSettings:
        """Return the settings of the truth that differs from a config's by this shift."""
        return CauseSettings.from_dict(causes | self.causes, icp | {"method": self.method})


def _truth(job: Job) -> CauseSettings:
    shift = read_settings(Shift, job.section("shift"))
    return shift.truth(job.section("causes") | job.section("drawn"), job.section("icp"))


def draw(job: Job) -> None:
    """Draw the test samples of a shift, of all sources and seeds."""
    settings, objects = _truth(job), {path.stem: path for path in job.objects}
    for path in job.causes:
        source, seed = path.parent.name, seed_of_file(path)
        with record_provenance([path], [objects[source]], job.settings, seed=seed):
            causes, _, _ = draw_shifted(ObjectClouds.load(objects[source], source), source, seed, settings)
            causes.save(path)


def observe(job: Job) -> None:
    """Describe and re-enact the samples of a shift, given the method and which cloud moved, and nothing else of it."""
    shifted = _truth(job)
    given = replace(CauseSettings.from_dict(job.section("causes")), icp=shifted.icp, moved=shifted.moved)
    remedies = DescriptorSettings(**job.section("descriptors"))
    reenactment = read_settings(ReenactmentSettings, job.section("reenactment"))
    for path, described, enacted in zip(job.causes, job.descriptors, job.reenactments, strict=True):
        axes = path.parent.name, seed_of_file(path)
        with record_provenance([described, enacted], [path], job.settings, seed=axes[1]):
            causes = Causes.load(path, axes)
            describe_all(causes, *axes, remedies, given.icp)[0].save(described)
            reenact_all(causes, *axes, reenactment, given)[0].save(enacted)


@dataclass(frozen=True)
class Asked:
    """Test samples of one shift and source, and the files of what explainers read of them."""

    shift: str
    source: str
    causes: Causes
    files: dict[str, Path]

    def registrations(self, reads: str = "") -> Registrations:
        """Return them with labels, and with what explainers read."""
        every = labeled(self.causes)
        every = with_what_it_reads(every, reads, self.files[reads]) if reads else every
        return every.subset(self.causes.rows("test"))


def asked_about(job: Job) -> Iterator[Asked]:
    """Yield the test samples of the truth that was learned and of each shift; a shift's files are named by it."""
    files = list(zip(job.causes, job.descriptors, job.reenactments, strict=True))
    shifted = list(zip(job.shifted_causes, job.shifted_descriptors, job.shifted_reenactments, strict=True))
    for path, described, enacted in files + shifted:
        shift = STANDARD if path in job.causes else path.parts[-4]
        yield Asked(shift, path.parent.name, Causes.load(path), {DESCRIBED: described, REENACTED: enacted})


def diagnose(job: Job) -> None:
    """Train every explainer on the training samples of all sources, and ask it about each shift -> its predictions."""
    learned = learned_files(job)
    inputs = [path for paths in learned.values() for path in paths]
    inputs += [*job.shifted_causes, *job.shifted_descriptors, *job.shifted_reenactments]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        asked = [each for each in asked_about(job) if each.source in job.sources_asked]

        def read(reads: str) -> Registrations:
            return Registrations.joined([each.registrations(reads) for each in asked])

        tested = [each.causes.registrations.subset(each.causes.rows("test")) for each in asked]
        every, starts = read(""), asked[0].causes.T_target_source_runs.shape[1]
        world = World(job, learned, every, starts, read, apart=True)
        counts = [len(part) for part in tested]
        columns = {
            "shift": np.repeat([each.shift for each in asked], counts),
            "source": np.repeat([each.source for each in asked], counts),
            "sample": np.concatenate([part.sample for part in tested]),
            "concept_true": np.concatenate([part.concept for part in tested]),  # of borderline samples as well
        }
        write_csv(job.predictions, world.predictions(job.section("explainers"), every, **columns))
