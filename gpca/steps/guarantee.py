"""Step ``guarantee_scores``: measured causes -> scores by models that were not trained on the families that they score.

An explainer of descriptors or re-enactments is trained on one part of the families and scores all others. Predictions
of explainers of embeddings are those of the diagnosis, since their encoders would have to be trained again: the models
of a seed are trained on none of the families that they are tested on. Depth frames are scored by the explainers of the
frames' causes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labeled, observed_only
from gpca.causes.descriptors import Descriptors
from gpca.causes.truth import BORDERLINE
from gpca.errors import InputError
from gpca.explainers.interface import EMBEDDINGS
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.answers import SCORES, Scored
from gpca.guarantee.guarantee import states_of
from gpca.io.arrays import REGENERATE
from gpca.io.container import REGENERATE_BOTH, require_same_samples
from gpca.io.csv_file import ANY, read_csv
from gpca.io.files import Axes
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import BY_ICP
from gpca.pairs.dataset import Registrations
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.seeds import generator, seed_of_file

if TYPE_CHECKING:
    import pandas as pd

FRAME_COLUMNS = ("sample", "instance", "truth")
PARTS = 3  # of families that no file deals into folds
SEVERITIES = ("severity_noise", "severity_rotation_rad", "severity_translation", "severity_crop")


@dataclass(frozen=True)
class Pool:
    """N registrations of all sources and seeds.

    Attributes:
        registrations: with their labels, and all inputs of explainers attached.
        samples: them as they are scored, without scores.
        part: (N,) of the family; models are trained on one part each.
    """

    registrations: Registrations
    samples: Scored
    part: np.ndarray

    def scored(self, rows: np.ndarray, model: str, seen_n: np.ndarray, scores_n_4: np.ndarray) -> Scored:
        """Scores that a model gave n rows."""
        return replace(self.samples.subset(rows), model=np.full(len(rows), model), seen=seen_n, scores=scores_n_4)


def read_pool(causes_files: Sequence[Path], descriptors: Sequence[Path], reenactments: Sequence[Path]) -> Pool:
    """Read the registrations of every source and seed; the files of all three lists have one order."""
    parts, columns = [], []
    for path, described, enacted in zip(causes_files, descriptors, reenactments, strict=True):
        causes = Causes.load(path)
        source, seed = axes_of(causes.registrations, path)
        state = states_of(causes.truth)
        rows = np.flatnonzero(state != BORDERLINE)
        registrations, again = labeled(causes), Reenactments.load(enacted, causes.registrations)
        measured = {"verdict": again.verdict, "reenactment": reenactment_features(again)}
        measured |= dict(Descriptors.load(described, causes.registrations).groups)
        parts.append(replace(registrations, attached={**registrations.attached, **measured}).subset(rows))
        keys = _keys(parts[-1].split, parts[-1].sample)  # as in the files; joined samples are numbered anew
        columns.append((np.full(len(rows), source), np.full(len(rows), seed), keys, state[rows]))
    registrations, count = Registrations.joined(parts), sum(map(len, parts))
    source_N, seed_N, sample_N, state_N = (np.concatenate(column) for column in zip(*columns, strict=True))
    # The largest severity of any cause, as a share of the most in any sample.
    each_N_4 = np.column_stack([getattr(registrations, name) for name in SEVERITIES])
    samples = Scored(
        model=np.full(count, ""),
        source=source_N,
        seed=seed_N,
        sample=sample_N,
        family=registrations.cluster,
        state=state_N,
        seen=np.zeros(count, bool),
        severity=(each_N_4 / np.maximum(each_N_4.max(axis=0), 1e-12)).max(axis=1),
        weight=np.ones(count),
        scores=np.zeros((count, len(LABELS))),
    )
    return Pool(registrations, samples, parts_of(registrations.cluster, registrations.fold))


def axes_of(registrations: Registrations, path: Path) -> Axes:
    """Source and seed that are stored in the file; InputError where they are not."""
    if registrations.axes is None:
        raise InputError(path, "does not say of which source and seed it is", REGENERATE)
    return registrations.axes


def parts_of(family_N: np.ndarray, fold_N: np.ndarray) -> np.ndarray:
    """Part (N,) of each sample's family: its fold, or where no file gives it one, a drawn part."""
    folds = {str(family): int(fold) for family, fold in zip(family_N, fold_N, strict=True) if fold >= 0}
    others = sorted({str(family) for family in family_N} - set(folds))
    drawn = generator("guarantee", "parts").permutation(len(others))
    folds |= {family: int(number) % PARTS for family, number in zip(others, drawn, strict=True)}
    return np.array([folds[str(family)] for family in family_N])


def run(job: Job) -> None:
    outputs = {path.stem: path for path in job.scores}
    frames = list(zip(job.frame_causes, job.frame_samples, job.frame_predictions, strict=True))
    inputs = [*job.causes, *job.descriptors, *job.reenactments, *job.diagnoses, *sum(frames, ())]
    with record_provenance(job.scores, inputs, job.settings):
        pool = read_pool(job.causes, job.descriptors, job.reenactments)
        for name, settings in job.section("explainers").items():
            as_is = list(scored_as_is(pool, [path for path in job.diagnoses if path.parts[-2] == name]))
            reads = explainer_entry(name, CAUSES).reads
            parts = as_is if reads == EMBEDDINGS else list(scored_anew(pool, name, settings or {}))
            Scored.joined([*parts, *scored_on_frames(frames, name, as_is)]).save(outputs[name])


def scored_anew(pool: Pool, name: str, settings: Mapping) -> Iterator[Scored]:
    """Yield the scores of all samples by each model, which was trained on one part of the families.

    Models that all give the same scores are not trained at all; they are one model that has seen no sample.
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

    Models of one seed have one name: together they are one rule for a pair of any source.
    """
    for path in prediction_files:
        source, seed = path.parts[-3], seed_of_file(path)
        rows = np.flatnonzero((pool.samples.source == source) & (pool.samples.seed == seed))
        predicted, keys = _predicted(read_predictions(path)), pool.samples.sample[rows].tolist()
        if missing := [key for key in keys if key not in predicted]:
            raise InputError(path, "lacks the {} sample {}".format(*missing[0].split()), "regenerate it")
        scores_n_4 = np.array([predicted[key] for key in keys]).reshape(-1, len(LABELS))
        yield pool.scored(rows, f"seed {seed}", np.array([key.startswith("train") for key in keys]), scores_n_4)


def scored_on_frames(frames: Sequence[tuple[Path, Path, Path]], name: str, as_is: Sequence[Scored]) -> Iterator[Scored]:
    """Yield an explainer's scores of depth frames, and those of the test samples for their calibration.

    Scenes whose true poses were made by ICP are left out. The weights of all starts of an instance add up to one.

    Args:
        frames: files of causes, samples and predictions of every seed.
        as_is: results of :func:`scored_as_is`.
    """
    for causes_file, sample_file, prediction_file in frames:
        causes, samples = Causes.load(causes_file), read_csv(sample_file, FRAME_COLUMNS, others=ANY)
        predictions = read_predictions(prediction_file, labels=("explainer",))
        predicted = _predicted(predictions[predictions["explainer"] == name])
        registrations, state = causes.registrations, states_of(causes.truth)
        _, seed = axes_of(registrations, causes_file)
        numbers = registrations.sample.astype(str)
        require_same_samples(sample_file, samples, registrations.arrays, "causes of frames", ("sample",))
        if predicted and set(predicted) != {f"test {number}" for number in numbers}:
            raise InputError(prediction_file, "its samples differ from those of the causes of frames", REGENERATE_BOTH)
        rows = np.flatnonzero((state != BORDERLINE) & (samples["truth"] != BY_ICP).to_numpy())
        if not (predicted and as_is and len(rows)):
            continue
        model = f"frames {seed}"
        for part in as_is:
            tested = part.subset(~part.seen & (part.seed == seed))
            yield replace(tested, model=np.full(len(tested), model))
        instances = samples["instance"].to_numpy(str)[rows]
        _, number_n, size_K = np.unique(instances, return_inverse=True, return_counts=True)
        yield Scored(
            model=np.full(len(rows), model),
            source=np.full(len(rows), REAL_WORLD),
            seed=np.full(len(rows), seed),
            sample=numbers[rows],
            family=registrations.cluster[rows],
            state=state[rows],
            seen=np.zeros(len(rows), bool),
            severity=np.zeros(len(rows)),
            weight=1 / size_K[number_n],
            scores=np.array([predicted[f"test {numbers[row]}"] for row in rows]),
        )


def _keys(split_N: Iterable, number_N: Iterable) -> list[str]:
    return [f"{split} {number}" for split, number in zip(split_N, number_N, strict=True)]


def _predicted(predictions: pd.DataFrame) -> dict[str, np.ndarray]:
    """Split and number of each sample -> its scores, which are equal where the explainer abstained."""
    scores_N_4 = predictions[list(SCORES)].to_numpy(float)
    scores_N_4 = np.where(predictions["abstained"].to_numpy()[:, None], 1 / len(LABELS), scores_N_4)
    return dict(zip(_keys(predictions["split"], predictions["sample"]), scores_N_4, strict=True))
