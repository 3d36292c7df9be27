"""Step ``frame_causes``: instances of depth frames -> their measured causes, and what explainers say of them.

The explainers have learned from registrations whose causes were drawn, those of all sources; no frame is among them.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import Causes
from gpca.causes.frames import chosen_instances, measure_frames
from gpca.causes.labels import LABELS, labeled
from gpca.causes.settings import CauseSettings, FrameCauseSettings
from gpca.encoders.settings import EncoderSettings
from gpca.errors import InputError
from gpca.experiments.diagnosis.step import observed_only, training_rows, with_what_it_reads
from gpca.explainers.registry import CAUSES, explainer_entry, require_settings
from gpca.features.dataset import Descriptors, describe_all
from gpca.features.settings import DescriptorSettings
from gpca.frames.instances import Instances
from gpca.frames.meshes import datasets_of, files_behind, meshes_of, models_of
from gpca.frames.plausibility import require_of_objects
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, joined
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections

if TYPE_CHECKING:
    import pandas as pd

SECTIONS = {
    "frames": ("real_world", "causes"),
    "datasets": ("real_world", "datasets"),
    "causes": ("causes",),
    "icp": ("registrations", "icp"),
    "descriptors": ("diagnosis", "descriptors"),
    "encoder": ("diagnosis", "encoder"),
    "explainers": ("diagnosis", "explainers"),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config.

    What explainers learn from is a file of each source, in the same order.
    """
    parser.add_argument("--source", required=True, help="name of the frames, which seeds the draws")
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--scenes", type=Path, help="folder written by the step scenes, in place of datasets")
    parser.add_argument("--data-dir", help="folder with the datasets; what is there is not downloaded")
    parser.add_argument("--downloads", default="data/downloads", type=Path, help="where downloads are kept")
    parser.add_argument("--instances", required=True, type=Path)
    parser.add_argument("--objects", required=True, type=Path, help="canonical clouds of the frames' objects")
    parser.add_argument("--causes", required=True, type=Path, nargs="+", help="drawn causes")
    parser.add_argument(
        "--descriptors", required=True, type=Path, nargs="+", help="their descriptors, in the same order"
    )
    parser.add_argument("--encoders", required=True, type=Path, nargs="+", help="weights of encoders trained on them")
    parser.add_argument(
        "--embeddings", required=True, type=Path, nargs="+", help="their embeddings from these encoders"
    )
    parser.add_argument("--out", required=True, type=Path, help="measured causes of the frames")
    parser.add_argument("--samples", required=True, type=Path, help="CSV of where each was seen and what was found")
    parser.add_argument("--predictions", required=True, type=Path, help="CSV of what every explainer says about each")


def run(options: Namespace) -> None:
    """Measure the instances, describe them, and ask every explainer."""
    import pandas as pd
    import torch

    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    for name, settings in given["explainers"].items():
        require_settings(name, settings or {}, CAUSES)
    lessons = _files_of_sources(options)
    frames = files_behind(given["datasets"], options.data_dir, options.scenes)
    inputs = [options.instances, options.objects, *frames, *(path for files in lessons for path in files)]
    outputs = [options.out, options.samples, options.predictions]
    with record_provenance(outputs, inputs, options.settings, seed=options.seed):
        causes, samples = _measure(options, given)
        axes = (options.source, options.seed)
        icp = ICPSettings(**given["icp"])
        described, _, _ = describe_all(causes, *axes, DescriptorSettings(**given["descriptors"]), icp)
        said = _Asked(causes, described, EncoderSettings(**given["encoder"]), axes, lessons)
        said_of: list[pd.DataFrame] = []
        for name, settings in given["explainers"].items():
            attribution = said.attribution(name, settings or {})
            said_of.append(prediction_frame(causes.registrations, attribution).assign(explainer=name))
        causes.save(options.out)
        write_csv(options.samples, samples)
        write_csv(options.predictions, pd.concat(said_of))


def _files_of_sources(options: Namespace) -> list[tuple[Path, Path, Path, Path]]:
    """Return the files of each source: causes, descriptors, encoder, embeddings."""
    for name in ("descriptors", "encoders", "embeddings"):
        if (found := len(getattr(options, name))) != len(options.causes):
            raise InputError(
                f"--{name}", f"{found} file(s) for {len(options.causes)} file(s) of --causes", "give one for each"
            )
    return list(zip(options.causes, options.descriptors, options.encoders, options.embeddings, strict=True))


def _measure(options: Namespace, given: dict) -> tuple[Causes, pd.DataFrame]:
    instances, objects = (
        Instances.load(options.instances, options.source),
        ObjectClouds.load(options.objects, options.source),
    )
    require_of_objects(instances, objects, options.instances)
    chosen = FrameCauseSettings(**given["frames"])
    rows = chosen_instances(instances, options.source, chosen)
    datasets = datasets_of(given["datasets"], options.data_dir, options.downloads, options.scenes)
    meshes = meshes_of(models_of(datasets), objects, instances.object_index[rows].tolist())
    settings = CauseSettings.from_dict(given["causes"], given["icp"])
    return measure_frames(instances, rows, objects, meshes, options.source, options.seed, settings, chosen.points)


class _Asked:
    """Registrations of frames that explainers are asked about, and the lessons that these have had."""

    def __init__(
        self, causes: Causes, described: Descriptors, encoder: EncoderSettings, axes: tuple[str, int], lessons: list
    ) -> None:
        self._registrations = observed_only(labeled(causes))
        self._described = described
        self._encoder = encoder
        self._axes = axes
        self._lessons = lessons
        self._embedded: list[tuple[Registrations, Registrations]] = []
        self._of_descriptors: list[tuple[Registrations, Registrations]] = []

    def attribution(self, name: str, settings: dict) -> Attribution:
        """Return the mean of the scores over all that the explainer learns from.

        Descriptors of all sources are learned together; embeddings are by an encoder for each source.
        """
        entry = explainer_entry(name, CAUSES)
        said = []
        for lessons, asked in self._pairs_by_embedding() if entry.reads == "embeddings" else self._pairs_described():
            explainer = entry.make(*self._axes, **settings)
            explainer.fit(lessons)
            said.append(explainer.explain(asked))
        abstained_N = np.all([each.abstained_N for each in said], axis=0)
        scores_N_4 = np.mean([each.scores_N_C for each in said], axis=0)
        return Attribution.of_scores(LABELS, scores_N_4, seconds=0.0, abstained_N=abstained_N)

    def _pairs_described(self) -> list[tuple[Registrations, Registrations]]:
        if not self._of_descriptors:
            entry = explainer_entry("gpca_pair", CAUSES)
            parts = []
            for causes, descriptors, _, _ in self._lessons:
                registrations = with_what_it_reads(labeled(Causes.load(causes)), entry, descriptors)
                parts.append(registrations.subset(training_rows(registrations, causes)))
            asked = self._with(self._described.groups)
            self._of_descriptors = [(_joined(parts), asked)]
        return self._of_descriptors

    def _pairs_by_embedding(self) -> list[tuple[Registrations, Registrations]]:
        if not self._embedded:
            from gpca.encoders.training import embed
            from gpca.encoders.weights import load_model

            entry = explainer_entry("gpca", CAUSES)
            for causes, _, weights, embeddings in self._lessons:
                registrations = with_what_it_reads(labeled(Causes.load(causes)), entry, embeddings)
                model = load_model(weights, self._encoder, LABELS, registrations.axes, step="train_on_causes")
                h_S_d, logits_S_C = embed(model, self._registrations, *self._axes, self._encoder)
                lessons = registrations.subset(training_rows(registrations, causes))
                self._embedded.append((lessons, self._with({"embedding": h_S_d, "head_logits": logits_S_C})))
        return self._embedded

    def _with(self, arrays: Mapping[str, np.ndarray]) -> Registrations:
        return replace(self._registrations, attached={**self._registrations.attached, **arrays})


def _joined(parts: Sequence[Registrations]) -> Registrations:
    attached = {name: np.concatenate([part.attached[name] for part in parts]) for name in parts[0].attached}
    return replace(joined(parts), attached=attached)
