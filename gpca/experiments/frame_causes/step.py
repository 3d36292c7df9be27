"""Step ``frame_causes``: instances of depth frames -> causes of their registrations, and explainers' predictions.

The explainers have learned from registrations whose causes were drawn, those of all sources; no frame is among them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS, Causes, labeled
from gpca.causes.frames import chosen_starts, measure_frames
from gpca.causes.settings import CauseSettings, FrameCauseSettings
from gpca.encoders.settings import EncoderSettings
from gpca.experiments.diagnosis.step import observed_only, training_rows, with_what_it_reads
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.explainers.sight import icp_calls
from gpca.features.dataset import Descriptors, describe_all
from gpca.features.settings import DescriptorSettings
from gpca.frames.instances import Instances
from gpca.frames.meshes import datasets_of, files_behind, meshes_of, models_of
from gpca.frames.plausibility import require_of_objects
from gpca.frames.starts import all_starts
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.objects.splits import EVALUATION
from gpca.pairs.dataset import Registrations, joined
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings

if TYPE_CHECKING:
    import pandas as pd


def run(job: Job) -> None:
    """Measure the instances, describe them, and ask every explainer."""
    import pandas as pd

    # Of each source: causes, descriptors, encoder, embeddings.
    lessons = list(zip(job.causes, job.descriptors, job.encoders, job.embeddings, strict=True))
    frames = files_behind(job.section("datasets"), job.data_dir, job.get("scenes"))
    inputs = [job.instances, job.objects, *frames, *(path for files in lessons for path in files)]
    outputs = [job.frame_causes, job.samples, job.predictions]
    with record_provenance(outputs, inputs, job.settings, seed=job.seed):
        causes, samples = _measure(job)
        axes = (job.source, job.seed)
        icp = ICPSettings(**job.section("icp"))
        settings = DescriptorSettings(**job.section("descriptors"))
        described, _, _ = describe_all(causes, *axes, settings, icp)
        encoder = EncoderSettings(**job.section("encoder"))
        explained = _FramesToExplain(causes, described, settings, encoder, axes, lessons)
        said_of: list[pd.DataFrame] = []
        for name, own in job.section("explainers").items():
            attribution = explained.attribution(name, own or {})
            said_of.append(prediction_frame(causes.registrations, attribution).assign(explainer=name))
        causes.save(job.frame_causes)
        write_csv(job.samples, samples)
        write_csv(job.predictions, pd.concat(said_of))


def _measure(job: Job) -> tuple[Causes, pd.DataFrame]:
    instances, objects = Instances.load(job.instances, job.source), ObjectClouds.load(job.objects, job.source)
    require_of_objects(instances, objects, job.instances)
    own = read_settings(FrameCauseSettings, job.section("frames"))
    places = job.get("scenes"), job.get("splits"), job.settings.get("role", EVALUATION)
    datasets = datasets_of(job.section("datasets"), job.data_dir, job.downloads, *places)
    models = models_of(datasets)
    starts = chosen_starts(all_starts(instances, objects, datasets, models, own.rungs), instances, job.source, own)
    meshes = meshes_of(models, objects, instances.object_index[starts.instance].tolist())
    settings = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    causes, samples = measure_frames(instances, starts, objects, meshes, job.source, job.seed, settings, own.points)
    seen = zip(samples["dataset"], samples["scene"], strict=True)
    return causes, samples.assign(truth=[datasets[name].place(scene).truth for name, scene in seen])


class _FramesToExplain:
    """Registrations of frames to be explained, and the training data of the explainers."""

    def __init__(
        self,
        causes: Causes,
        described: Descriptors,
        settings: DescriptorSettings,
        encoder: EncoderSettings,
        axes: tuple[str, int],
        lessons: list,
    ) -> None:
        self._registrations = observed_only(labeled(causes))
        self._described = described
        self._encoder = encoder
        self._axes = axes
        self._lessons = lessons
        self._calls = partial(icp_calls, starts=causes.T_target_source_runs.shape[1], descriptors=settings)
        self._embedded: list[tuple[Registrations, Registrations]] = []
        self._of_descriptors: list[tuple[Registrations, Registrations]] = []

    def attribution(self, name: str, settings: dict) -> Attribution:
        """Return the mean of the scores over all that the explainer learns from.

        Descriptors of all sources are learned together; embeddings are by an encoder for each source.
        """
        entry = explainer_entry(name, CAUSES)
        attributions = []
        for lessons, explained in (
            self._pairs_by_embedding() if entry.reads == "embeddings" else self._pairs_described()
        ):
            explainer = entry.make(*self._axes, **settings)
            explainer.fit(lessons)
            attributions.append(explainer.explain(explained))
        abstained_N = np.all([each.abstained_N for each in attributions], axis=0)
        scores_N_4 = np.mean([each.scores_N_C for each in attributions], axis=0)
        calls = self._calls(entry.sees)
        return Attribution.of_scores(LABELS, scores_N_4, seconds=0.0, icp_calls=calls, abstained_N=abstained_N)

    def _pairs_described(self) -> list[tuple[Registrations, Registrations]]:
        if not self._of_descriptors:
            entry = explainer_entry("gpca_pair", CAUSES)
            parts = []
            for causes, descriptors, _, _ in self._lessons:
                registrations = with_what_it_reads(labeled(Causes.load(causes)), entry, descriptors)
                parts.append(registrations.subset(training_rows(registrations, causes)))
            explained = self._with(self._described.groups)
            self._of_descriptors = [(_joined(parts), explained)]
        return self._of_descriptors

    def _pairs_by_embedding(self) -> list[tuple[Registrations, Registrations]]:
        if not self._embedded:
            from gpca.encoders.training import embed
            from gpca.encoders.weights import load_model

            entry = explainer_entry("gpca", CAUSES)
            for causes, _, weights, embeddings in self._lessons:
                registrations = with_what_it_reads(labeled(Causes.load(causes)), entry, embeddings)
                model = load_model(weights, self._encoder, LABELS, registrations.axes)
                h_S_d, logits_S_C = embed(model, self._registrations, *self._axes, self._encoder)
                lessons = registrations.subset(training_rows(registrations, causes))
                self._embedded.append((lessons, self._with({"embedding": h_S_d, "head_logits": logits_S_C})))
        return self._embedded

    def _with(self, arrays: Mapping[str, np.ndarray]) -> Registrations:
        return replace(self._registrations, attached={**self._registrations.attached, **arrays})


def _joined(parts: Sequence[Registrations]) -> Registrations:
    attached = {name: np.concatenate([part.attached[name] for part in parts]) for name in parts[0].attached}
    return replace(joined(parts), attached=attached)
