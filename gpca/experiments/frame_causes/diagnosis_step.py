"""Step ``diagnose_frames``: causes of registrations of depth frames -> explainers' predictions.

The explainers have learned from registrations whose causes were drawn, those of all sources; no frame is among them.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import Causes, labeled
from gpca.causes.descriptors import describe_all
from gpca.experiments.diagnosis.step import DESCRIBED, EMBEDDED, World, observed_only
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.dataset import Reenactments, reenactment_features

if TYPE_CHECKING:
    import pandas as pd


def run(job: Job) -> None:
    """Describe the registrations, and ask every explainer."""
    import pandas as pd

    # Of each source; re-enactments only where an explainer reads them.
    lessons = {"causes": job.causes, DESCRIBED: job.descriptors, "encoders": job.encoders, EMBEDDED: job.embeddings}
    lessons |= {REENACTED: job.get("reenactments", [])}
    enacted = job.get("frame_reenactments")
    read = [job.frame_causes, *([enacted] if enacted else [])]
    inputs = read + [path for paths in lessons.values() for path in paths]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        causes = Causes.load(job.frame_causes, (job.source, job.seed))
        explained = FramesToExplain(job, causes, enacted, lessons)
        said_of: list[pd.DataFrame] = []
        for name, own in job.section("explainers").items():
            attribution = explained.attribution(name, own or {})
            said_of.append(prediction_frame(causes.registrations, attribution).assign(explainer=name))
        write_csv(job.predictions, pd.concat(said_of))


class FramesToExplain(World):
    """Registrations of frames to be explained; see :class:`gpca.experiments.diagnosis.step.World`.

    Args:
        enacted: the re-enactments of the frames.
        lessons: files of all sources, by what explainers read.
    """

    def __init__(self, job: Job, causes: Causes, enacted: Path | None, lessons: dict[str, list[Path]]) -> None:
        super().__init__(job, lessons, labeled(causes), causes.T_target_source_runs.shape[1])
        self._causes, self._enacted = causes, enacted
        self._icp = ICPSettings(**job.section("icp"))

    def prepare(self, name: str) -> None:
        """Measure what an explainer reads, once for all that read the same."""
        self._sets(explainer_entry(name, CAUSES))

    def attribution(self, name: str, settings: dict) -> Attribution:
        """Return the mean of the scores over all that the explainer learns from."""
        entry = explainer_entry(name, CAUSES)
        attributions = []
        for learned, frames in self._sets(entry):
            explainer = entry.make(*self._axes, **settings)
            explainer.fit(learned)
            attributions.append(explainer.explain(observed_only(frames)))
        return self._mean(entry, attributions)

    def _read(self, reads: str) -> Registrations:
        if reads == DESCRIBED:
            described, _, _ = describe_all(self._causes, *self._axes, self._descriptors, self._icp)
            read = described.groups
        else:
            assert self._enacted is not None
            enacted = Reenactments.load(self._enacted, self._registrations)
            read = {"verdict": enacted.verdict, "reenactment": reenactment_features(enacted)}
        return replace(self._registrations, attached={**self._registrations.attached, **read})
