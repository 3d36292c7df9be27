"""Step ``guarantee_scores``: measured causes -> scores by models that saw no sample of the families that they score."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labeled, observed_only
from gpca.causes.truth import BORDERLINE
from gpca.explainers.interface import EMBEDDINGS, REENACTED, answer_of
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.answers import SCORES, Scored
from gpca.guarantee.guarantee import states_of
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, read_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import BY_ICP
from gpca.pairs.dataset import Registrations
from gpca.seeds import generator, seed_of_file
from gpca.steps.diagnosis import DESCRIBED, with_what_it_reads

FRAME_COLUMNS = ("sample", "instance", "truth")
PARTS = 3  # of families that no file deals into folds
SEVERITIES = ("severity_noise", "severity_rotation_rad", "severity_translation", "severity_crop")
# N registrations of all sources and seeds, with labels and all inputs of explainers; them as they are scored.
Pool = tuple[Registrations, Scored]


def read_pool(causes_files: Sequence[Path], descriptors: Sequence[Path], reenactments: Sequence[Path]) -> Pool:
    """Read the registrations of every source and seed; the files of all three lists have one order."""
    parts, columns = [], []
    for path, described, enacted in zip(causes_files, descriptors, reenactments, strict=True):
        axes = path.parent.name, seed_of_file(path)
        causes = Causes.load(path, axes)
        state = states_of(causes.truth)
        rows = np.flatnonzero(state != BORDERLINE)
        registrations = with_what_it_reads(labeled(causes), DESCRIBED, described)
        parts.append(with_what_it_reads(registrations, REENACTED, enacted).subset(rows))
        keys = _keys(parts[-1].split, parts[-1].sample)  # as in the files; joined samples are numbered anew
        columns.append((*(np.full(len(rows), axis) for axis in axes), keys, state[rows]))
    registrations, count = Registrations.joined(parts), sum(map(len, parts))
    source_N, seed_N, sample_N, state_N = (np.concatenate(column) for column in zip(*columns, strict=True))
    # The largest severity of any cause, as a share of the most in any sample.
    each_N_4 = np.column_stack([getattr(registrations, name) for name in SEVERITIES])
    return registrations, Scored(
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
        registrations, samples = read_pool(job.causes, job.descriptors, job.reenactments)
        for name, settings in job.section("explainers").items():
            as_is = list(scored_as_is(samples, [path for path in job.diagnoses if path.parts[-2] == name]))
            parts = as_is
            if explainer_entry(name, CAUSES).reads != EMBEDDINGS:
                parts = list(scored_anew(registrations, samples, name, settings or {}))
            Scored.joined([*parts, *scored_on_frames(frames, name, as_is)]).save(outputs[name])


def scored_anew(registrations: Registrations, samples: Scored, name: str, settings: Mapping) -> Iterator[Scored]:
    """Yield the scores of all samples by each model, trained on one part of the families; equal ones are one model."""
    hidden, part_N = observed_only(registrations), parts_of(registrations.cluster, registrations.fold)
    scores: dict[int, np.ndarray] = {}
    for part in np.unique(part_N).tolist():
        explainer = explainer_entry(name, CAUSES).make("guarantee", part, **settings)
        explainer.fit(registrations.subset(np.flatnonzero(part_N == part)))
        scores[part] = answer_of(explainer, hidden, LABELS).scores_N_C
    first_N_4 = next(iter(scores.values()))
    if all(np.array_equal(scores_N_4, first_N_4) for scores_N_4 in scores.values()):
        yield replace(samples, model=np.full(len(samples), "untrained"), scores=first_N_4)
        return
    for part, scores_N_4 in scores.items():
        yield replace(samples, model=np.full(len(samples), f"part {part}"), seen=part_N == part, scores=scores_N_4)


def scored_as_is(samples: Scored, prediction_files: Sequence[Path]) -> Iterator[Scored]:
    """Yield the scores of the diagnosis; models of one seed have one name, as together they are one rule."""
    for path in prediction_files:
        seed = seed_of_file(path)
        own = samples.subset((samples.source == path.parts[-3]) & (samples.seed == seed))
        predicted, keys = _predicted(read_predictions(path)), own.sample.tolist()
        scores_n_4 = np.array([predicted[key] for key in keys]).reshape(-1, len(LABELS))
        seen_n = np.array([key.startswith("train") for key in keys])
        yield replace(own, model=np.full(len(own), f"seed {seed}"), seen=seen_n, scores=scores_n_4)


def scored_on_frames(frames: Sequence[tuple[Path, Path, Path]], name: str, as_is: Sequence[Scored]) -> Iterator[Scored]:
    """Yield an explainer's scores of depth frames, and those of the test samples for their calibration."""
    for causes_file, sample_file, prediction_file in frames:
        causes, samples = Causes.load(causes_file), read_csv(sample_file, FRAME_COLUMNS, others=ANY)
        predictions = read_predictions(prediction_file, labels=("explainer",))
        predicted = _predicted(predictions[predictions["explainer"] == name])
        registrations, state, seed = causes.registrations, states_of(causes.truth), seed_of_file(causes_file)
        numbers = registrations.sample.astype(str)
        require_same_samples(sample_file, samples, registrations.arrays, "causes of frames", ("sample",))
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


def _predicted(predictions: Frame) -> dict[str, np.ndarray]:
    """Split and number of each sample -> its scores, which are equal where the explainer abstained."""
    scores_N_4 = predictions[list(SCORES)].to_numpy(float)
    scores_N_4 = np.where(predictions["abstained"].to_numpy()[:, None], 1 / len(LABELS), scores_N_4)
    return dict(zip(_keys(predictions["split"], predictions["sample"]), scores_N_4, strict=True))
