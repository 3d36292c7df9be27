"""Step ``registrations``: canonical clouds -> ``registrations/{source}/seed{seed}.npz``."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.attribution.predictions import write_timings
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the config's section ``registrations``."""
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times of ICP")


def run(options: Namespace) -> None:
    """Perturb and align."""
    check_settings(options.settings, "registrations")
    settings = RegistrationSettings.from_dict(options.settings)
    objects = ObjectClouds.load(options.objects, options.source)
    with record_provenance([options.out, options.timings], [options.objects], options.settings, seed=options.seed):
        registrations, icp_seconds_S = make_registrations(objects, options.source, options.seed, settings)
        registrations.save(options.out)
        write_timings(options.timings, registrations, icp_seconds_S, icp_seconds_S)
