"""Step ``controls``: registrations and embeddings -> predictions of every explainer under every control."""

from __future__ import annotations

from gpca.alignment.icp import ICPSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, load_model
from gpca.experiments.controls.protocol import ControlRun
from gpca.experiments.controls.samples import sample_table
from gpca.experiments.controls.settings import HARD, PAPER, ControlSettings
from gpca.experiments.controls.variants import left_out, variant
from gpca.explainers.rivals import make_rivals
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings
from gpca.uncertainty.settings import UncertaintySettings


def run(job: Job) -> None:
    """Let every explainer learn and explain under the paper's protocol and under each control."""
    rivals = make_rivals(job.section("explainers"), job.source, job.seed)
    settings = read_settings(ControlSettings, job.section("controls"))
    encoder = EncoderSettings(**job.section("encoder"))
    icp = ICPSettings(**job.section("icp"))
    runs = {name: value for name, value in job.section("uncertainty").items() if name != "samples"}
    retrained = dict(zip(job.retrained, job.retrained_embeddings, strict=True))
    others = dict(zip(job.others, job.other_registrations, strict=True))
    axes = (job.source, job.seed)
    inputs = [job.objects, job.registrations, job.encoder, job.embeddings]
    inputs += [*retrained.values(), *others.values(), *filter(None, [job.get("hard")])]
    with record_provenance([job.predictions, job.samples, job.timings], inputs, job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, axes)
        hard = Registrations.load(job.hard, axes) if job.get("hard") else None
        model = load_model(job.encoder, encoder, axes=axes)
        embeddings = {PAPER: read_embedding(job.embeddings, registrations, logits=True)}
        for control, path in retrained.items():
            if control == HARD and hard:
                embeddings[control] = read_embedding(path, hard, logits=True)
            elif not left_out(control, registrations, settings, encoder.backbone):
                changed = variant(control, registrations, job.source, job.seed, settings, icp)
                embeddings[control] = read_embedding(path, changed, logits=True)
        experiment = ControlRun(
            source=job.source,
            seed=job.seed,
            settings=settings,
            backbone=encoder.backbone,
            uncertainty=UncertaintySettings(**runs, icp=icp),
            rivals=rivals,
            embed=lambda registrations_of_others, source: embed(
                model, registrations_of_others, source, job.seed, encoder
            ),
            embeddings=embeddings,
            hard=hard,
        )
        registrations_of_others = {name: Registrations.load(path, (name, job.seed)) for name, path in others.items()}
        rows = experiment.run(registrations, registrations_of_others)
        asked = {PAPER: registrations} | ({HARD: hard} if hard else {})
        samples = sample_table(asked, ObjectClouds.load(job.objects, job.source))
        write_csv(job.predictions, rows)
        write_csv(job.samples, samples)
        write_csv(job.timings, experiment.costs.rows())
