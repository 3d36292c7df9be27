"""The steps of registrations with measured causes: causes, descriptors, re-enactments, encoders, and the model file."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_timings, write_timings
from gpca.causes.dataset import LABELS, Causes, with_label
from gpca.causes.descriptors import describe_all
from gpca.causes.drawing import draw_causes
from gpca.causes.policy import RecoveryPolicy
from gpca.causes.settings import CauseSettings, DescriptorSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.inference import TrainedEncoder
from gpca.encoders.registry import EncoderSettings
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.model.clouds import Familiarity
from gpca.model.diagnoser import TrainingSet, learn
from gpca.model.file import Model
from gpca.model.proposed import Proposed, pose_errors, proposed_for_all, with_repair
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings


def causes(job: Job) -> None:
    """Draw candidates, measure their causes and keep a balanced set -> ``causes/{source}/seed{seed}.npz``."""
    section, icp = job.settings_and_icp()
    settings = CauseSettings.from_dict(section, icp)
    objects = ObjectClouds.load(job.objects, job.source)
    with record_provenance([job.causes, job.candidates, job.timings], [job.objects], job.settings, seed=job.seed):
        causes, tally, icp_seconds_S = draw_causes(objects, job.source, job.seed, settings)
        causes.save(job.causes)
        tally.save(job.candidates)
        write_timings(job.timings, causes.registrations, icp_seconds_S, icp_seconds_S)


def describe(job: Job) -> None:
    """Describe every pair -> ``descriptors/{source}/seed{seed}.npz``."""
    section, icp = job.settings_and_icp()
    _measure(job, job.descriptors, describe_all, DescriptorSettings(**section), ICPSettings(**icp))


def reenact(job: Job) -> None:
    """Re-enact every pair under hypotheses of its true pose -> ``reenactments/{source}/seed{seed}.npz``."""
    settings = read_settings(ReenactmentSettings, job.section("reenactment"))
    truth = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    _measure(job, job.reenactments, reenact_all, settings, truth)


def _measure(job: Job, out: Path, measure: Callable[..., tuple], *settings: Any) -> None:
    """Write what a function measures of every pair, and the seconds that it adds to those of the registrations."""
    with record_provenance([out, job.timings], [job.causes, job.causes_timings], job.settings, seed=job.seed):
        causes = Causes.load(job.causes, job.axes)
        seconds_S, icp_seconds_S = read_timings(job.causes_timings, causes.registrations)
        measured, own_S, own_icp_S = measure(causes, job.source, job.seed, *settings)
        measured.save(out)
        write_timings(job.timings, causes.registrations, seconds_S + own_S, icp_seconds_S + own_icp_S)


def train_on_causes(job: Job) -> None:
    """Train an encoder on the training samples with a label of causes -> weights, curve, embeddings of all samples."""
    import pandas as pd

    from gpca.encoders.training import embed, train_encoder, write_weights

    settings = EncoderSettings(**job.settings)
    checkpoint = job.weights.with_suffix(".checkpoint")
    outputs = [job.weights, job.curve, job.embeddings, job.timings]
    with record_provenance(outputs, [job.causes, job.causes_timings], job.settings, seed=job.seed):
        causes = Causes.load(job.causes, job.axes)
        registrations = causes.registrations
        seconds_S, icp_seconds_S = read_timings(job.causes_timings, registrations)
        model, curve = train_encoder(with_label(causes), *job.axes, settings, checkpoint, LABELS)
        started = perf_counter()
        h_S_d, logits_S_C = embed(model, registrations, *job.axes, settings)
        seconds = (perf_counter() - started) / len(h_S_d)
        write_weights(job.weights, model, job.axes)
        write_csv(job.curve, pd.DataFrame(curve), form="%.6g")
        arrays = {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}
        save_arrays(job.embeddings, arrays, job.axes)
        write_timings(job.timings, registrations, seconds_S + seconds, icp_seconds_S)
        checkpoint.unlink(missing_ok=True)


def model(job: Job) -> None:
    """Fit all classifiers and write them with the encoder and the policy -> ``model.pt``, for ``gpca explain``."""
    from gpca.encoders.training import load_model

    inputs = [job.registrations, job.encoder, job.embeddings, *job.objects, *job.causes, *job.reenactments]
    with record_provenance([job.out], inputs, job.settings, seed=job.seed):
        icp, section = job.section("registrations").get("icp", {}), job.section("model")
        truth, sets, proposals = CauseSettings.from_dict(job.section("causes") | section.get("causes", {}), icp), [], []
        for objects_path, path, enacted in zip(job.objects, job.causes, job.reenactments, strict=True):
            causes = Causes.load(path)
            reenactments = Reenactments.load(enacted, causes.registrations)
            sets.append(TrainingSet.of(causes, reenactments))
            axes_of = causes.registrations.axes
            errors = pose_errors(causes, ObjectClouds.load(objects_path, axes_of[0] if axes_of else None))
            proposals.append(proposed_for_all(causes, reenactments, errors, truth.icp, truth.moved))
        diagnoser, bald_N, result_N_of = learn(
            TrainingSet.joined(sets),
            GPCSettings(**section.get("classifier", {})),
            truth,
            ReenactmentSettings(**job.section("reenactment")),
            section.get("false_alarms", 0.05),
            *("model", job.seed),
        )
        diagnoser = replace(diagnoser, levels=with_repair(diagnoser.levels, Proposed.joined(proposals), result_N_of))
        settings, recovery = EncoderSettings(**job.section("encoder")), job.section("recovery")
        registrations = Registrations.load(job.registrations, job.axes)
        h_S_d, train = read_embedding(job.embeddings, registrations)["embedding"], registrations.rows("train")
        gpc = GPC(CONCEPTS, GPCSettings(**job.section("gpc")), *job.axes)
        policy = RecoveryPolicy()
        if recovery:
            thresholds, treatments, budget = recovery["thresholds"], recovery["treatments"], recovery["loop"]["budget"]
            policy = RecoveryPolicy.of_settings(thresholds, treatments, budget, bald_N)
        clouds = ((registrations.cloud(row).astype(float), registrations.target(row).astype(float)) for row in train)
        Model(
            diagnoser=diagnoser,
            encoder=TrainedEncoder.of(load_model(job.encoder, settings, axes=job.axes).encoder, settings),
            gpc=gpc.fit(h_S_d[train], registrations.concept[train]),
            icp=ICPSettings(**icp),
            cloud_points=job.section("registrations").get("cloud_points", 2048),
            policy=policy,
            title=job.title,
            stand_in=job.get("stand_in"),
            learned_from=tuple(job.get("learned_from", ())),
            familiar=Familiarity.of(clouds),
        ).save(job.out)
