"""GP-CA by severity: on test samples that were perturbed weakly or strongly, and trained on such ranges."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.evaluation.intervals import mean_ranks
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.shifted_sets import ShiftedSets
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.steps.readings.files import Row, RunFiles, accuracies, accuracies_of_named, like_the_training, train_and_test
from gpca.steps.readings.gpc_start import gpc_scores
from gpca.steps.readings.groups import Reading

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
    """Third of its concept's samples in which the severity of each sample lies.

    That of a pose error is the mean of the ranks of its angle and its length.
    """
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
    """Make the sets of samples of a source and seed within other severities, from the random numbers of the protocol.

    An encoder learns from them as that of the protocol does.
    """
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import embedding_by, train_encoder
    from gpca.steps.shift import ShiftSettings, sets_of_encoder

    axes = (job.source, job.seed)
    parts = {name: job.section(name) for name in ("shift", "registrations", "encoder")}
    settings, encoder_settings = ShiftSettings.from_dicts(**parts), EncoderSettings(**parts["encoder"])
    checkpoint = job.out.with_suffix(".checkpoint")  # no output of the rule: a rerun continues from it
    with record_provenance([job.out], [job.objects], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        samples, _ = make_registrations(objects, *axes, RegistrationSettings.from_dict(parts["registrations"]))
        model, _ = train_encoder(samples, *axes, encoder_settings, checkpoint)
        embed_own = embedding_by(model, job.seed, encoder_settings)
        samples = replace(samples, attached={"embedding": embed_own(samples, job.source)[0]})
        sets_of_encoder(objects, samples, None, embed_own, *axes, settings).save(job.out, axes)
        checkpoint.unlink(missing_ok=True)
