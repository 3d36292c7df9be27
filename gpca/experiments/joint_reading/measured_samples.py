"""The samples that joint readings are measured on, and the settings that they leave as they are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gpca.active_learning.settings import ActiveLearningSettings
from gpca.alignment.icp import ICPSettings
from gpca.experiments.specification_curve.run_files import like_the_training
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.shifted_sets import ShiftedSets
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.job import Job
from gpca.uncertainty.settings import UncertaintySettings


@dataclass(frozen=True)
class Subjects:
    """What the values are of.

    Attributes:
        sets: the samples, with embeddings by an encoder that learned from samples of the same severities.
        pairs: some of the test samples like the training's, for Monte-Carlo ICP.
        axes: source and seed.
    """

    sets: ShiftedSets
    pairs: Registrations
    axes: tuple[str, int]

    def split(self, split: str) -> Registrations:
        """Return the training samples, or the test samples like them, with their embeddings."""
        samples = like_the_training(self.sets)
        return samples.subset(samples.rows(split))

    @classmethod
    def load(cls, objects: ObjectClouds, sets: Path, axes: tuple[str, int], registrations: dict, samples: int):
        """Read the sets of a source and seed, and make so many of their pairs anew.

        Args:
            objects: of the source.
            sets: file of the step ``shift`` or ``retrain``.
            axes: source and seed.
            registrations: the config's section of that name, with the severities of the sets.
            samples: test samples for Monte-Carlo ICP, a multiple of 3.
        """
        settings = RegistrationSettings.from_dict(registrations)
        few = replace(settings, train=0, test=min(samples, settings.test))
        return cls(ShiftedSets.load(sets, axes), make_registrations(objects, *axes, few)[0], axes)


@dataclass(frozen=True)
class MeasureSettings:
    """What joint readings leave as it is.

    Attributes:
        gpc: the paper's setting, of which the reading changes kernel, rate and iterations.
        labels: the rounds of labels, and the accuracy that counts as reached.
        uncertainty: Monte-Carlo ICP under the knobs.
    """

    gpc: dict[str, Any]
    labels: ActiveLearningSettings
    target: float
    uncertainty: UncertaintySettings

    @classmethod
    def of_job(cls, job: Job) -> MeasureSettings:
        """Read the sections of the config that a rule gives; ``labels`` changes those of ``active_learning``."""
        active = job.section("active_learning")
        additive = {name: value for name, value in job.section("uncertainty").items() if name != "samples"}
        return cls(
            job.section("gpca_paper"),
            ActiveLearningSettings.from_dict(active | job.section("labels")),
            active["target"],
            UncertaintySettings(**additive, icp=ICPSettings(**job.section("icp"))),
        )
