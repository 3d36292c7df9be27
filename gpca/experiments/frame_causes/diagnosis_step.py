"""Step ``diagnose_frames``: causes of registrations of depth frames -> explainers' predictions.

The explainers have learned from registrations whose causes were drawn, those of all sources; no frame is among them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS, Causes, labeled
from gpca.causes.descriptors import describe_all
from gpca.causes.settings import DescriptorSettings
from gpca.encoders.registry import EncoderSettings
from gpca.experiments.diagnosis.step import observed_only, training_rows, with_what_it_reads
from gpca.explainers.interface import REENACTED, ExplainerEntry, icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.settings import ReenactmentSettings

if TYPE_CHECKING:
    import pandas as pd

EMBEDDED, DESCRIBED = "embeddings", "descriptors"  # `reads` of explainers; all but these and `REENACTED` need neither


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


class FramesToExplain:
    """Registrations of frames to be explained, and the training data of the explainers.

    Args:
        enacted: the re-enactments of the frames.
        lessons: files of all sources, by what explainers read.
    """

    def __init__(self, job: Job, causes: Causes, enacted: Path | None, lessons: dict[str, list[Path]]) -> None:
        self._axes = (job.source, job.seed)
        self._causes, self._enacted, self._lessons = causes, enacted, lessons
        self._encoder = EncoderSettings(**job.section("encoder"))
        self._settings = DescriptorSettings(**job.section("descriptors"))
        self._icp = ICPSettings(**job.section("icp"))
        starts = causes.T_target_source_runs.shape[1]
        reenactment = ReenactmentSettings(**job.section("reenactment")).calls(starts)
        self._calls = partial(icp_calls, starts=starts, descriptors=self._settings, reenactment=reenactment)
        self._pairs: dict[str, list[tuple[Registrations, Registrations]]] = {}

    def prepare(self, name: str) -> None:
        """Measure what an explainer reads, once for all that read the same."""
        self._learned_and_explained(explainer_entry(name, CAUSES))

    def attribution(self, name: str, settings: dict) -> Attribution:
        """Return the mean of the scores over all that the explainer learns from.

        Descriptors and re-enactments of all sources are learned together; embeddings are by an encoder for each source.
        """
        entry = explainer_entry(name, CAUSES)
        attributions = []
        for lessons, explained in self._learned_and_explained(entry):
            explainer = entry.make(*self._axes, **settings)
            explainer.fit(lessons)
            attributions.append(explainer.explain(explained))
        abstained_N = np.all([each.abstained_N for each in attributions], axis=0)
        scores_N_4 = np.mean([each.scores_N_C for each in attributions], axis=0)
        calls = self._calls(entry.sees)
        return Attribution.of_scores(LABELS, scores_N_4, seconds=0.0, icp_calls=calls, abstained_N=abstained_N)

    def _learned_and_explained(self, entry: ExplainerEntry) -> list[tuple[Registrations, Registrations]]:
        reads = entry.reads if entry.reads in (EMBEDDED, REENACTED) else DESCRIBED
        if reads not in self._pairs:
            if reads == EMBEDDED:
                self._pairs[reads] = self._embedded(entry)
            else:
                entry = entry if reads == REENACTED else explainer_entry("gpca_pair", CAUSES)
                explained = self._enacted_frames(entry) if reads == REENACTED else self._described_frames()
                self._pairs[reads] = [(Registrations.joined(self._learned(entry, reads)), explained)]
        return self._pairs[reads]

    def _learned(self, entry: ExplainerEntry, reads: str) -> list[Registrations]:
        """Return the training rows of each source, with what an explainer reads."""
        parts = []
        for causes, path in zip(self._lessons["causes"], self._lessons[reads], strict=True):
            registrations = with_what_it_reads(labeled(Causes.load(causes)), entry, path)
            parts.append(registrations.subset(training_rows(registrations, causes)))
        return parts

    def _described_frames(self) -> Registrations:
        described, _, _ = describe_all(self._causes, *self._axes, self._settings, self._icp)
        observed = observed_only(labeled(self._causes))
        return replace(observed, attached={**observed.attached, **described.groups})

    def _enacted_frames(self, entry: ExplainerEntry) -> Registrations:
        assert self._enacted is not None
        return observed_only(with_what_it_reads(labeled(self._causes), entry, self._enacted))

    def _embedded(self, entry: ExplainerEntry) -> list[tuple[Registrations, Registrations]]:
        from gpca.encoders.training import embed, load_model

        observed, pairs = observed_only(labeled(self._causes)), []
        for learned, weights in zip(self._learned(entry, EMBEDDED), self._lessons["encoders"], strict=True):
            model = load_model(weights, self._encoder, LABELS, learned.axes)
            h_S_d, logits_S_C = embed(model, observed, *self._axes, self._encoder)
            attached = {**observed.attached, "embedding": h_S_d, "head_logits": logits_S_C}
            pairs.append((learned, replace(observed, attached=attached)))
        return pairs
