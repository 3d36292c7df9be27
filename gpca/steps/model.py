"""Step ``model``: what all sources say of causes, and GP-CA of one -> ``model.pt``, for ``python -m gpca explain``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import torch

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.weights import load_model
from gpca.features.dataset import Descriptors
from gpca.features.settings import DescriptorSettings
from gpca.model.familiarity import Familiarity
from gpca.model.file import Model
from gpca.model.learning import Lessons, joined, learn
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.arguments import SEED, require_files
from gpca.process.provenance import record_provenance
from gpca.recovery.policy import RecoveryPolicy
from gpca.settings import checked_sections

SECTIONS = {
    "encoder": ("encoders", "*"),
    "gpc": ("explainers", "gpca"),
    "registrations": ("registrations",),
    "recovery": ("recovery",),
    "causes": ("causes",),
    "descriptors": ("diagnosis", "descriptors"),
    "model": ("model",),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` holds what `SECTIONS` names of the config."""
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--title", required=True, help="title of the objects, shown in explanations")
    parser.add_argument("--stand-in", action="store_true", help="the objects were drawn by the package")
    parser.add_argument("--registrations", required=True, type=Path)
    parser.add_argument("--encoder", required=True, type=Path, help="encoder weights")
    parser.add_argument("--embeddings", required=True, type=Path, help="embeddings from that encoder")
    parser.add_argument(
        "--causes",
        required=True,
        type=Path,
        nargs="+",
        help="measured causes, one file per source; the observed cloud moves",
    )
    parser.add_argument(
        "--descriptors", required=True, type=Path, nargs="+", help="their descriptors, in the same order"
    )
    parser.add_argument("--out", required=True, type=Path)


def run(options: Namespace) -> None:
    """Fit both classifiers and write them with the encoder and the policy."""
    torch.set_num_threads(options.threads)
    given = checked_sections(options.settings, SECTIONS)
    require_files(options, "descriptors", len(options.causes), "file(s) of --causes")
    inputs = [options.registrations, options.encoder, options.embeddings, *options.causes, *options.descriptors]
    with record_provenance([options.out], inputs, options.settings, seed=options.seed):
        icp, own = given["registrations"].get("icp", {}), given["model"]
        diagnoser, bald_N = learn(
            joined([_lessons(*files) for files in zip(options.causes, options.descriptors, strict=True)]),
            GPCSettings(**own.get("classifier", {})),
            CauseSettings.from_dict(given["causes"] | own.get("causes", {}), icp),
            DescriptorSettings(**given["descriptors"]),
            own.get("false_alarms", 0.05),
            *("model", options.seed),
        )
        settings, axes = EncoderSettings(**given["encoder"]), (options.source, options.seed)
        recovery = given["recovery"]
        registrations = Registrations.load(options.registrations, axes)
        Model(
            diagnoser=diagnoser,
            encoder=load_model(options.encoder, settings, axes=axes).encoder,
            encoder_settings=settings,
            gpc=_gpc(options, registrations, GPCSettings(**given["gpc"])),
            icp=ICPSettings(**icp),
            cloud_points=given["registrations"].get("cloud_points", 2048),
            policy=RecoveryPolicy.of_settings(
                recovery["thresholds"], recovery["treatments"], recovery["loop"]["budget"], bald_N
            )
            if recovery
            else RecoveryPolicy(),
            title=options.title,
            stand_in=options.stand_in,
            familiar=Familiarity.of(
                (registrations.cloud(row).astype(float), registrations.target(row).astype(float))
                for row in registrations.rows("train")
            ),
        ).save(options.out)


def _lessons(causes_file: Path, descriptors_file: Path) -> Lessons:
    causes = Causes.load(causes_file)
    return Lessons.of(causes, Descriptors.load(descriptors_file, causes.registrations))


def _gpc(options: Namespace, registrations: Registrations, settings: GPCSettings) -> GPC:
    h_S_d = read_embedding(options.embeddings, registrations)["embedding"]
    train = registrations.rows("train")
    return GPC(CONCEPTS, settings, options.source, options.seed).fit(h_S_d[train], registrations.concept[train])
