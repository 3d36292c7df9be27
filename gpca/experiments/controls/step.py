"""Step ``controls``: registrations and embeddings -> what every explainer says under every control."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import torch

from gpca.alignment.icp import ICPSettings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import embed
from gpca.encoders.weights import load_model
from gpca.errors import InputError
from gpca.experiments.controls.protocol import ControlRun
from gpca.experiments.controls.rivals import make_rivals
from gpca.experiments.controls.samples import sample_table
from gpca.experiments.controls.settings import PAPER, RETRAINED, TRAININGS, ControlSettings
from gpca.experiments.controls.variants import left_out, variant
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.arguments import SEED, require_files
from gpca.process.provenance import record_provenance
from gpca.settings import checked_sections
from gpca.uncertainty.settings import UncertaintySettings

SECTIONS = {
    "controls": ("controls",),
    "encoder": ("encoders", "*"),
    "uncertainty": ("uncertainty", "removal"),
    "icp": ("registrations", "icp"),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config, `explainers` by name too."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--encoder", required=True, type=Path, help="weights of the paper's protocol")
    parser.add_argument("--embeddings", required=True, type=Path, help="embeddings from that encoder")
    retrained = (*RETRAINED, *TRAININGS)
    parser.add_argument(
        "--retrained", nargs="*", default=[], choices=retrained, help="controls with their own embeddings"
    )
    parser.add_argument(
        "--retrained-embeddings", nargs="*", default=[], type=Path, help="their embeddings, in the same order"
    )
    parser.add_argument("--others", nargs="*", default=[], help="names of the other sources")
    parser.add_argument(
        "--other-registrations", nargs="*", default=[], type=Path, help="their registrations, in the same order"
    )
    parser.add_argument("--out", required=True, type=Path, help="predictions")
    parser.add_argument("--samples", required=True, type=Path, help="CSV of the test samples' severities and errors")
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times of the explainers")


def run(options: Namespace) -> None:
    """Let every explainer learn and explain under the paper's protocol and under each control."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS, by_name=("explainers",))
    rivals = make_rivals(given["explainers"], options.source, options.seed)
    settings, encoder = ControlSettings.from_dict(given["controls"]), EncoderSettings(**given["encoder"])
    icp = ICPSettings(**given["icp"])
    runs = {name: value for name, value in given["uncertainty"].items() if name != "samples"}
    retrained = _pairs(options, "retrained", "retrained_embeddings")
    others = _pairs(options, "others", "other_registrations")
    if missing := set(settings.controls) & set(RETRAINED) - set(retrained):
        raise InputError("--retrained", f"lacks control '{sorted(missing)[0]}'", "give its embeddings")
    axes = (options.source, options.seed)
    inputs = [options.objects, options.registrations, options.encoder, options.embeddings]
    inputs += [*retrained.values(), *others.values()]
    with record_provenance(
        [options.out, options.samples, options.timings], inputs, options.settings, seed=options.seed
    ):
        registrations = Registrations.load(options.registrations, axes)
        model = load_model(options.encoder, encoder, axes=axes)
        embeddings = {PAPER: read_embedding(options.embeddings, registrations, logits=True)}
        for control, path in retrained.items():
            if not left_out(control, registrations, settings, encoder.backbone):
                changed = variant(control, registrations, options.source, options.seed, settings, icp)
                embeddings[control] = read_embedding(path, changed, "train_control", logits=True)
        experiment = ControlRun(
            source=options.source,
            seed=options.seed,
            settings=settings,
            backbone=encoder.backbone,
            uncertainty=UncertaintySettings(**runs, icp=icp),
            rivals=rivals,
            embed=lambda asked, source: embed(model, asked, source, options.seed, encoder),
            embeddings=embeddings,
        )
        asked = {name: Registrations.load(path, (name, options.seed)) for name, path in others.items()}
        rows = experiment.run(registrations, asked)
        samples = sample_table(registrations, ObjectClouds.load(options.objects, options.source))
        write_csv(options.out, rows)
        write_csv(options.samples, samples)
        write_csv(options.timings, experiment.costs.rows())


def _pairs(options: Namespace, names: str, files: str) -> dict[str, Path]:
    given = getattr(options, names)
    require_files(options, files, len(given), "name(s)")
    return dict(zip(given, getattr(options, files), strict=True))
