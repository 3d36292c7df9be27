"""Step ``exchange``: registrations -> explanations with other methods and estimators of uncertainty beneath them."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path

import torch

from gpca.alignment.methods.registry import require_settings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import embed
from gpca.encoders.weights import load_model
from gpca.experiments.controls.rivals import make_rivals
from gpca.experiments.judge import Judges
from gpca.experiments.substitution.asked import DESIGN, require_exchangeable
from gpca.experiments.substitution.exchange import Exchange
from gpca.experiments.substitution.settings import ExchangeSettings
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.process.arguments import SEED, per_seed
from gpca.process.provenance import record_provenance
from gpca.settings import checked_by_name, checked_sections
from gpca.uncertainty.estimators.registry import require_estimator_settings
from gpca.uncertainty.settings import UncertaintySettings

BY_NAME = ("methods", "estimators", "explainers")  # name -> settings; what is not in them has none
SECTIONS = {
    "exchange": ("exchange",),
    "uncertainty": ("uncertainty", DESIGN),
    "encoder": ("encoders", "*"),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds `SECTIONS` and `BY_NAME` of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--registrations", required=True, type=Path, nargs="+", help="one per seed")
    parser.add_argument("--encoders", required=True, type=Path, nargs="+", help="encoder weights, one per seed")
    parser.add_argument("--out", required=True, type=Path, nargs="+", help="CSVs of what explainers say, one per seed")


def run(options: Namespace) -> None:
    """Let every explainer learn and explain with each method and each estimator beneath it, seed by seed."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS, BY_NAME)
    for name in given["explainers"]:
        require_exchangeable(name)
    settings, encoder = ExchangeSettings.from_dict(given["exchange"]), EncoderSettings(**given["encoder"])
    methods = checked_by_name(given["methods"], "methods", settings.methods, require_settings)
    estimators = checked_by_name(given["estimators"], "estimators", settings.estimators, require_estimator_settings)
    runs = {name: value for name, value in given["uncertainty"].items() if name != "samples"}
    objects = ObjectClouds.load(options.objects, options.source)
    for seed, registrations_path, weights, out in per_seed(options, "registrations", "encoders", "out"):
        rivals = make_rivals(given["explainers"], options.source, seed)
        inputs = [options.objects, registrations_path, weights]
        with record_provenance([out], inputs, options.settings, seed=seed):
            exchange = Exchange(
                source=options.source,
                seed=seed,
                settings=settings,
                methods=methods,
                estimators=estimators,
                uncertainty=UncertaintySettings(**runs),
                rivals=rivals,
                embed=partial(_embedded, load_model(weights, encoder, axes=(options.source, seed)), encoder, seed),
            )
            judges = Judges(objects, f"objects of {options.source}")
            write_csv(out, exchange.run(Registrations.load(registrations_path, (options.source, seed)), judges))


def _embedded(model, encoder: EncoderSettings, seed: int, asked: Registrations, source: str):
    return embed(model, asked, source, seed, encoder)
