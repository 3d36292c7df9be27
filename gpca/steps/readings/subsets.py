"""GP-CA by severity, and Table VI: accuracies on parts of the samples, of other encoders, from other starts."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embedding_by, train_encoder
from gpca.evaluation.intervals import mean_ranks
from gpca.evaluation.measures import ALL
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.shifted_sets import ShiftedSets
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.progress import progress
from gpca.seeds import generator
from gpca.settings import read_settings
from gpca.steps.readings.files import Row, RunFiles, accuracies, accuracies_of_named, like_the_training, train_and_test
from gpca.steps.readings.groups import Reading
from gpca.steps.readings.learners import gpc_scores
from gpca.steps.shift import ShiftSettings, make_sets

THIRDS = ("weakest", "middle", "strongest")
CLASSIFIERS = {"paper": "gpca_paper", "converged": "gpca"}


def thirds(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies on all test samples, or on a third of each concept's."""
    for source, seed, registrations in run_files.loaded():
        test = registrations.subset(registrations.rows("test"))
        third_of = dict(zip(test.sample.astype(str), third_S(test), strict=True))
        for reading in readings:
            predictions = run_files.predictions.get((source, CLASSIFIERS[reading["classifier"]], seed))
            if predictions is None:
                continue
            rows = read_predictions(predictions)
            rows = rows[rows["split"] == "test"]
            if reading["part"] != "all":
                rows = rows[rows["sample"].map(third_of) == reading["part"]]
            values = accuracies_of_named(rows["concept_true"].to_numpy(), rows["concept_predicted"].to_numpy())
            yield reading, source, "gpca_paper", seed, values


def third_S(registrations: Registrations) -> np.ndarray:
    """Third of its concept's samples in which the severity of each sample lies."""
    names_S = np.empty(len(registrations), object)
    pose_S = mean_ranks(registrations.severity_rotation_rad) + mean_ranks(registrations.severity_translation)
    severities = {"noise": registrations.severity_noise, "pose": pose_S, "overlap": registrations.severity_crop}
    for concept, severity_S in severities.items():
        rows = np.flatnonzero(registrations.concept == concept)
        ranks = np.argsort(np.argsort(severity_S[rows], kind="stable"))
        names_S[rows] = np.array(THIRDS)[len(THIRDS) * ranks // max(len(rows), 1)]
    return names_S


def retrained(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of encoder and classifier that learned from other severities, on test samples of these."""
    for (severities, source, seed), path in run_files.retrained.items():
        train, test = train_and_test(like_the_training(ShiftedSets.load(path, (source, seed))))
        for reading in (reading for reading in readings if reading["range"] == severities):
            section = run_files.section(CLASSIFIERS[reading["classifier"]])
            scores_S_C = gpc_scores(section, train, test.embedding, source, seed)
            yield reading, source, "gpca_paper", seed, accuracies(test.concept, scores_S_C)


def retrain(job: Job) -> None:
    """Make the sets of samples within other severities, from the random numbers of the protocol."""
    parts = {name: job.section(name) for name in ("shift", "registrations", "encoder")}
    settings, encoder_settings = ShiftSettings.from_dicts(**parts), EncoderSettings(**parts["encoder"])
    checkpoint = job.out.with_suffix(".checkpoint")  # no output of the rule: a rerun continues from it
    with record_provenance([job.out], [job.objects], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        samples, _ = make_registrations(objects, *job.axes, read_settings(RegistrationSettings, parts["registrations"]))
        model, _ = train_encoder(samples, *job.axes, encoder_settings, checkpoint)
        embed_own = embedding_by(model, job.seed, encoder_settings)
        samples = replace(samples, attached={"embedding": embed_own(samples, job.source)[0]})
        make_sets(objects, samples, None, embed_own, *job.axes, settings, unseen_objects=False).save(job.out, job.axes)
        checkpoint.unlink(missing_ok=True)


def repeats(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of every backbone and reduction, repeat by repeat, and how concepts are confused."""
    by_seed = {seed: registrations for _, seed, registrations in run_files.loaded()}
    first, methods = next(iter(by_seed)), list(dict.fromkeys(method for _, method, _ in run_files.predictions))
    source = next(iter(run_files.registrations))[0]
    for varied in dict.fromkeys(reading["repeats"] for reading in readings):
        wanted = [reading for reading in readings if reading["repeats"] == varied]
        for method in progress(methods, f"repeats on depth frames: {varied}"):
            for seed, samples in by_seed.items():
                if varied == "everything":
                    named_S = run_files.predicted(source, method, seed)
                else:
                    samples = run_files.embedded(source, method, first)
                    rows = samples.rows("train")
                    if varied == "samples":
                        rows = generator(source, seed, "drawn samples").choice(rows, len(rows))
                    gpc = GPC(CONCEPTS, GPCSettings(**run_files.section("gpca")), source, seed, "repeat")
                    gpc.fit(samples.embedding[rows], samples.concept[rows])
                    named_S = _named(gpc.attribute(samples.embedding[samples.rows("test")])[0])
                yield from _rows(wanted, samples, named_S, source, method, seed)


def other_rows(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of the judged rows, or of others in their place, which the run may lack."""
    shown = {(source, seed): registrations for source, seed, registrations in run_files.loaded()}
    frames, published = run_files.section("frames"), run_files.section("published")
    for method in frames["methods"]:
        encoder, reduction = method.split("-")
        as_published = f"{published.get(encoder)}-{reduction}"
        for reading in readings:
            wanted = (
                frames["estimated" if reading.get("initial_pose") == "estimated" else "source"],
                as_published if reading.get("architecture") == "published" else method,
            )
            for source, name, seed in run_files.predictions:
                if (source, name) == wanted:
                    named_S = run_files.predicted(source, name, seed)
                    yield from _rows([reading], shown[source, seed], named_S, frames["source"], method, seed)


def _named(scores_S_C: np.ndarray) -> np.ndarray:
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]


def _rows(
    readings: Iterable[Reading], samples: Registrations, named_S: np.ndarray, source: str, method: str, seed: int
) -> Iterator[Row]:
    """Accuracies on test samples of the objects of each reading, and how often pose and overlap are confused."""
    train, test = (samples.rows(split) for split in ("train", "test"))
    seen_S = np.isin(samples.object_name[test], samples.object_name[train])
    shown = {"all": np.ones(len(test), bool), "seen": seen_S, "unseen": ~seen_S}
    for reading in (reading for reading in readings if shown[reading["objects"]].any()):
        chosen_S = shown[reading["objects"]]
        true_n, named_n = samples.concept[test][chosen_S], named_S[chosen_S]
        values = accuracies_of_named(true_n, named_n)
        for concept, other in (("pose", "overlap"), ("overlap", "pose")):
            values["test_samples", concept] = float((true_n == concept).sum())
            values[f"predicted_as_{other}", concept] = float((named_n[true_n == concept] == other).sum())
        yield reading, source, method, seed, values | {("test_samples", ALL): float(len(true_n))}
