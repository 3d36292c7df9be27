"""Step ``model``: encoder and embeddings of one source and seed -> ``model.pt``, for ``python -m gpca explain``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np
import torch

from gpca.alignment.icp import ICPSettings
from gpca.arguments import SEED
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import load_model
from gpca.model.file import Model
from gpca.pairs.dataset import Registrations, load_embeddings
from gpca.pairs.perturbation import CONCEPTS
from gpca.provenance import record_provenance
from gpca.recovery.policy import RecoveryPolicy
from gpca.settings import check_settings

SECTIONS = {
    "encoder": ("encoders", "*"),
    "gpc": ("explainers", "gpca"),
    "registrations": ("registrations",),
    "recovery": ("recovery",),
}
CALIBRATION = 5  # one training sample of so many is kept from a first classifier, which the threshold is chosen with


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--title", required=True, help="of the objects, as explanations name them")
    parser.add_argument("--stand-in", action="store_true", help="the objects were drawn by the package")
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--encoder", required=True, type=Path, help="weights")
    parser.add_argument("--embeddings", required=True, type=Path, help="of that encoder")
    parser.add_argument("--out", required=True, type=Path)


def run(options: Namespace) -> None:
    """Fit the classifier to the training samples and write it with the encoder and the policy."""
    torch.set_num_threads(options.threads)
    given = {name: options.settings.get(name) or {} for name in SECTIONS}
    for name, section in SECTIONS.items():
        check_settings(given[name], *section)
    inputs = [options.registrations, options.encoder, options.embeddings]
    with record_provenance([options.out], inputs, options.settings, seed=options.seed):
        registrations = Registrations.load(options.registrations)
        h_S_d = load_embeddings(options.embeddings, registrations, {"h": ("S", "d")}, "python -m gpca embed")["h"]
        train = registrations.rows("train")

        def fit_gpc(rows: np.ndarray) -> GPC:
            gpc = GPC(CONCEPTS, GPCSettings(**given["gpc"]), options.source, options.seed)
            return gpc.fit(h_S_d[rows], registrations.concept[rows])

        settings = EncoderSettings(**given["encoder"])
        Model(
            encoder=load_model(options.encoder, settings).encoder,
            encoder_settings=settings,
            gpc=fit_gpc(train),
            icp=ICPSettings(**given["registrations"].get("icp", {})),
            cloud_points=given["registrations"].get("cloud_points", 2048),
            policy=_policy(given["recovery"], train, fit_gpc, h_S_d),
            title=options.title,
            stand_in=options.stand_in,
        ).save(options.out)


def _policy(recovery: dict, train: np.ndarray, fit_gpc, h_S_d: np.ndarray) -> RecoveryPolicy:
    """Return the config's policy; its threshold is chosen on training samples that a classifier did not learn."""
    if not recovery:
        return RecoveryPolicy()
    kept = np.arange(len(train)) % CALIBRATION == CALIBRATION - 1
    _, _, bald_N = fit_gpc(train[~kept]).attribute(h_S_d[train[kept]])
    return RecoveryPolicy.of_settings(
        recovery["thresholds"], recovery["treatments"], recovery["loop"]["budget"], bald_N
    )
