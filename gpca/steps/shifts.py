"""The steps of shifted truths: samples of one shift, what explainers read of them, and what they answer (Table IX)."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gpca.alignment.icp import Method
from gpca.causes.dataset import Causes, labeled
from gpca.causes.descriptors import describe_all
from gpca.causes.drawing import draw_shifted
from gpca.causes.settings import CauseSettings, DescriptorSettings
from gpca.explainers.interface import BARE, REENACTED
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.reenactment.dataset import reenact_all
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import seed_of_file
from gpca.settings import read_settings
from gpca.steps.diagnosis import World, learned_files, with_what_it_reads

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


def diagnose(job: Job) -> None:
    """Train every explainer on the training samples of all sources, and ask it about each shift -> its predictions."""
    learned = learned_files(job)
    inputs = [path for paths in learned.values() for path in paths]
    inputs += [*job.shifted_causes, *job.shifted_descriptors, *job.shifted_reenactments]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        # Samples of the truth that was learned and of each shift, whose files are named by it; what is read of them.
        files = list(zip(job.causes, job.descriptors, job.reenactments, strict=True))
        files += zip(job.shifted_causes, job.shifted_descriptors, job.shifted_reenactments, strict=True)
        files = [each for each in files if each[0].parent.name in job.sources_asked]
        samples = [Causes.load(path) for path, _, _ in files]

        def read(reads: str = "") -> Registrations:
            parts = []
            for causes, (_, described, enacted) in zip(samples, files, strict=True):
                every = with_what_it_reads(labeled(causes), reads or BARE, enacted if reads == REENACTED else described)
                parts.append(every.subset(causes.rows("test")))
            return Registrations.joined(parts)

        shifts = [STANDARD if path in job.causes else path.parts[-4] for path, _, _ in files]
        tested = [causes.registrations.subset(causes.rows("test")) for causes in samples]
        every, starts = read(), samples[0].T_target_source_runs.shape[1]
        world = World(job, learned, every, starts, read, apart=True)
        counts = [len(part) for part in tested]
        columns = {
            "shift": np.repeat(shifts, counts),
            "source": np.repeat([path.parent.name for path, _, _ in files], counts),
            "sample": np.concatenate([part.sample for part in tested]),
            "concept_true": np.concatenate([part.concept for part in tested]),  # of borderline samples as well
        }
        write_csv(job.predictions, world.predictions(job.section("explainers"), every, **columns))
