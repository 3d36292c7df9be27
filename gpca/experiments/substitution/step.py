"""Step ``exchange``: registrations -> explanations with other methods and estimators of uncertainty beneath them."""

from __future__ import annotations

from functools import partial

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, load_model
from gpca.experiments.controls.rivals import make_rivals
from gpca.experiments.explained import require_exchangeable
from gpca.experiments.substitution.exchange import Exchange
from gpca.experiments.substitution.settings import ExchangeSettings
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.judge import Judges
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings
from gpca.uncertainty.settings import UncertaintySettings


def run(job: Job) -> None:
    """Let every explainer learn and explain with each method and each estimator beneath it, seed by seed."""
    for name in job.section("explainers"):
        require_exchangeable(name)
    settings = read_settings(ExchangeSettings, job.section("exchange"))
    encoder = EncoderSettings(**job.section("encoder"))
    methods = job.by_name("methods", settings.methods)
    estimators = job.by_name("estimators", settings.estimators)
    runs = {name: value for name, value in job.section("uncertainty").items() if name != "samples"}
    objects = ObjectClouds.load(job.objects, job.source)
    for seed, registrations_path, weights, out in job.per_seed("registrations", "encoders", "out"):
        rivals = make_rivals(job.section("explainers"), job.source, seed)
        inputs = [job.objects, registrations_path, weights]
        with record_provenance([out], inputs, job.settings, seed=seed):
            exchange = Exchange(
                source=job.source,
                seed=seed,
                settings=settings,
                methods=methods,
                estimators=estimators,
                uncertainty=UncertaintySettings(**runs),
                rivals=rivals,
                embed=partial(_embedded, load_model(weights, encoder, axes=(job.source, seed)), encoder, seed),
            )
            judges = Judges(objects, f"objects of {job.source}")
            write_csv(out, exchange.run(Registrations.load(registrations_path, (job.source, seed)), judges))


def _embedded(model, encoder: EncoderSettings, seed: int, registrations: Registrations, source: str):
    return embed(model, registrations, source, seed, encoder)
