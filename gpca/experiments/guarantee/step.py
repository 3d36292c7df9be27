"""Step ``guarantee``: causes and what is measured on them -> scores by models that never saw the families.

An explainer of descriptors or re-enactments learns from one part of the families and is asked about all others. One
of embeddings is asked as it is in the diagnosis, since its encoders would have to be trained again: the models of a
seed know none of the families that they are tested on. Frames are asked about by the explainers of the frames' causes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, observed_only
from gpca.causes.truth import BORDERLINE
from gpca.errors import InputError
from gpca.experiments.guarantee.experiment import EMBEDDINGS
from gpca.experiments.guarantee.pool import Pool, axes_of, read_pool
from gpca.experiments.guarantee.scored import SCORES, Scored, joined
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.guarantee import states_of
from gpca.io.container import REGENERATE_BOTH, require_same_samples
from gpca.io.csv_file import ANY, read_csv
from gpca.objects.canonical import BY_ICP
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    import pandas as pd

FRAME_COLUMNS = ("sample", "instance", "truth")


def run(job: Job) -> None:
    """Let every explainer learn and score."""
    own = {path.stem: path for path in job.scores}
    frames = list(zip(job.frame_causes, job.frame_samples, job.frame_predictions, strict=True))
    inputs = [*job.causes, *job.descriptors, *job.reenactments, *job.diagnoses, *sum(frames, ())]
    with record_provenance(job.scores, inputs, job.settings):
        pool = read_pool(job.causes, job.descriptors, job.reenactments)
        for name, settings in job.section("explainers").items():
            as_is = list(scored_as_is(pool, [path for path in job.diagnoses if path.parts[-2] == name]))
            reads = explainer_entry(name, CAUSES).reads
            parts = as_is if reads == EMBEDDINGS else list(scored_anew(pool, name, settings or {}))
            joined([*parts, *scored_on_frames(frames, name, as_is)]).save(own[name])


def scored_anew(pool: Pool, name: str, settings: Mapping) -> Iterator[Scored]:
    """Yield the scores of all samples by each model, which learned from one part of the families.

    Where all models give the same scores, nothing was learned, and they are one that was taught by no sample.
    """
    hidden, rows = observed_only(pool.registrations), np.arange(len(pool.part))
    scores: dict[int, np.ndarray] = {}
    for part in np.unique(pool.part).tolist():
        explainer = explainer_entry(name, CAUSES).make("guarantee", part, **settings)
        explainer.fit(pool.registrations.subset(np.flatnonzero(pool.part == part)))
        scores[part] = explainer.explain(hidden).scores_N_C
    first_N_4 = next(iter(scores.values()))
    if all(np.array_equal(scores_N_4, first_N_4) for scores_N_4 in scores.values()):
        yield pool.scored(rows, "untrained", np.zeros(len(rows), bool), first_N_4)
        return
    for part, scores_N_4 in scores.items():
        yield pool.scored(rows, f"part {part}", pool.part == part, scores_N_4)


def scored_as_is(pool: Pool, prediction_files: Sequence[Path]) -> Iterator[Scored]:
    """Yield the scores that the models of each source and seed gave in the diagnosis.

    Models of one seed have one name: together they are one rule for a pair of any source. None is asked about a family
    that it learned from.
    """
    for path in prediction_files:
        source, seed = path.parts[-3], seed_of_file(path)
        rows = np.flatnonzero((pool.source == source) & (pool.seed == seed))
        predictions = read_predictions(path)
        said = dict(_said(predictions))
        keys = [(split, str(number)) for split, number in zip(pool.split[rows], pool.sample[rows], strict=True)]
        if missing := [key for key in keys if key not in said]:
            raise InputError(path, f"lacks the {missing[0][0]} sample {missing[0][1]}", "regenerate it")
        scores_N_4 = np.array([said[key] for key in keys]).reshape(-1, len(LABELS))
        yield pool.scored(rows, f"seed {seed}", pool.split[rows] == "train", scores_N_4)


def scored_on_frames(frames: Sequence[tuple[Path, Path, Path]], name: str, as_is: Sequence[Scored]) -> Iterator[Scored]:
    """Yield what an explainer said of depth frames, beside the test samples of the diagnosis that it is calibrated on.

    Scenes whose true poses were made by ICP are left out, as everywhere. An instance counts once, however many starts
    it has.

    Args:
        frames: of every seed the files of causes, samples and predictions.
        as_is: what :func:`scored_as_is` gave.
    """
    for causes_file, sample_file, prediction_file in frames:
        causes, samples = Causes.load(causes_file), read_csv(sample_file, FRAME_COLUMNS, others=ANY)
        predictions = read_predictions(prediction_file, labels=("explainer",))
        said = dict(_said(predictions[predictions["explainer"] == name]))
        registrations, state = causes.registrations, states_of(causes.truth)
        _, seed = axes_of(registrations, causes_file)
        numbers = registrations.sample.astype(str)
        require_same_samples(sample_file, samples, registrations.arrays, "causes of frames", ("sample",))
        if said and set(said) != {("test", number) for number in numbers}:
            raise InputError(prediction_file, "its samples differ from those of the causes of frames", REGENERATE_BOTH)
        rows = np.flatnonzero((state != BORDERLINE) & (samples["truth"] != BY_ICP).to_numpy())
        if not (said and as_is and len(rows)):
            continue
        model = f"frames {seed}"
        for part in as_is:
            known = part.subset(~part.taught & (part.seed == seed))
            yield replace(known, model=np.full(len(known), model))
        instances = samples["instance"].to_numpy(str)[rows]
        _, number_n, size_K = np.unique(instances, return_inverse=True, return_counts=True)
        yield Scored(
            model=np.full(len(rows), model),
            source=np.full(len(rows), REAL_WORLD),
            seed=np.full(len(rows), seed),
            sample=numbers[rows],
            family=registrations.cluster[rows],
            state=state[rows],
            taught=np.zeros(len(rows), bool),
            severity=np.zeros(len(rows)),
            weight=1 / size_K[number_n],
            scores=np.array([said["test", numbers[row]] for row in rows]),
        )


def _said(predictions: pd.DataFrame) -> Iterator[tuple[tuple[str, str], np.ndarray]]:
    """Yield split and number of each sample, and its scores; those of one that was abstained from are equal."""
    scores_N_4 = predictions[list(SCORES)].to_numpy(float)
    scores_N_4 = np.where(predictions["abstained"].to_numpy()[:, None], 1 / len(LABELS), scores_N_4)
    yield from zip(zip(predictions["split"], predictions["sample"], strict=True), scores_N_4, strict=True)
