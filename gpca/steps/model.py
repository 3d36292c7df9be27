"""Step ``model``: encoder and embeddings of one source and seed -> ``model.pt``, for ``python -m gpca explain``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import torch

from gpca.dataset import Registrations, load_embeddings
from gpca.encoders.training import EncoderSettings, load_model
from gpca.gpc import GPC, GPCSettings
from gpca.model import Model
from gpca.perturbation import CONCEPTS
from gpca.provenance import recorded
from gpca.registration import ICPSettings
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds ``encoder``, ``gpc`` and ``registrations`` of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--title", required=True, help="of the objects, as explanations name them")
    parser.add_argument("--stand-in", action="store_true", help="the objects were drawn by the package")
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--encoder", required=True, type=Path, help="weights")
    parser.add_argument("--embeddings", required=True, type=Path, help="of that encoder")
    parser.add_argument("--out", required=True, type=Path)


def run(options: Namespace) -> None:
    """Fit the classifier to the training samples and write it with the encoder."""
    torch.set_num_threads(options.threads)
    encoder, gpc, made = (options.settings.get(name) or {} for name in ("encoder", "gpc", "registrations"))
    check_settings(encoder, "encoders", "*")
    check_settings(gpc, "explainers", "gpca")
    check_settings(made, "registrations")
    inputs = [options.registrations, options.encoder, options.embeddings]
    with recorded([options.out], inputs, options.settings, seed=options.seed):
        registrations = Registrations.load(options.registrations)
        h_S_d = load_embeddings(options.embeddings, registrations, {"h": ("S", "d")}, "python -m gpca embed")["h"]
        train = registrations.rows("train")
        settings = EncoderSettings(**encoder)
        Model(
            encoder=load_model(options.encoder, settings).encoder,
            encoder_settings=settings,
            gpc=GPC(CONCEPTS, GPCSettings(**gpc), options.source, options.seed).fit(
                h_S_d[train], registrations.concept[train]
            ),
            icp=ICPSettings(**made.get("icp", {})),
            points=made.get("points", 2048),
            title=options.title,
            stand_in=options.stand_in,
        ).save(options.out)
