"""Step ``model``: causes of all sources, and GP-CA of one -> ``model.pt``, for ``python -m gpca explain``."""

from __future__ import annotations

from pathlib import Path

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import load_model
from gpca.model.diagnoser import TrainingSet, learn
from gpca.model.familiarity import Familiarity
from gpca.model.file import Model
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.recovery.policy import RecoveryPolicy
from gpca.reenactment.dataset import Reenactments
from gpca.reenactment.settings import ReenactmentSettings


def run(job: Job) -> None:
    """Fit all classifiers and write them with the encoder and the policy."""
    inputs = [job.registrations, job.encoder, job.embeddings, *job.causes, *job.reenactments]
    with record_provenance([job.out], inputs, job.settings, seed=job.seed):
        icp, own = job.section("registrations").get("icp", {}), job.section("model")
        diagnoser, bald_N = learn(
            TrainingSet.joined([_training_set(*files) for files in zip(job.causes, job.reenactments, strict=True)]),
            GPCSettings(**own.get("classifier", {})),
            CauseSettings.from_dict(job.section("causes") | own.get("causes", {}), icp),
            ReenactmentSettings(**job.section("reenactment")),
            own.get("false_alarms", 0.05),
            *("model", job.seed),
        )
        settings, axes = EncoderSettings(**job.section("encoder")), (job.source, job.seed)
        recovery = job.section("recovery")
        registrations = Registrations.load(job.registrations, axes)
        Model(
            diagnoser=diagnoser,
            encoder=load_model(job.encoder, settings, axes=axes).encoder,
            encoder_settings=settings,
            gpc=_gpc(job, registrations, GPCSettings(**job.section("gpc"))),
            icp=ICPSettings(**icp),
            cloud_points=job.section("registrations").get("cloud_points", 2048),
            policy=RecoveryPolicy.of_settings(
                recovery["thresholds"], recovery["treatments"], recovery["loop"]["budget"], bald_N
            )
            if recovery
            else RecoveryPolicy(),
            title=job.title,
            stand_in=job.get("stand_in"),
            learned_from=tuple(job.get("learned_from", ())),
            familiar=Familiarity.of(
                (registrations.cloud(row).astype(float), registrations.target(row).astype(float))
                for row in registrations.rows("train")
            ),
        ).save(job.out)


def _training_set(causes_file: Path, reenactments_file: Path) -> TrainingSet:
    causes = Causes.load(causes_file)
    return TrainingSet.of(causes, Reenactments.load(reenactments_file, causes.registrations))


def _gpc(job: Job, registrations: Registrations, settings: GPCSettings) -> GPC:
    h_S_d = read_embedding(job.embeddings, registrations)["embedding"]
    train = registrations.rows("train")
    return GPC(CONCEPTS, settings, job.source, job.seed).fit(h_S_d[train], registrations.concept[train])
