"""Step ``causes``: canonical clouds -> ``causes/{source}/seed{seed}.npz``, registrations with measured causes."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.attribution.predictions import write_timings
from gpca.causes.drawing import draw_causes
from gpca.causes.settings import CauseSettings
from gpca.objects.canonical import ObjectClouds
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import checked_with_icp


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the config's section ``causes``, with ``icp`` of ``registrations``."""
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--candidates", required=True, type=Path, help="CSV of the number of refused candidates")
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times of ICP on the observed pairs")


def run(options: Namespace) -> None:
    """Draw candidates, measure their causes, keep a balanced set."""
    given, icp = checked_with_icp(options.settings, "causes")
    settings = CauseSettings.from_dict(given, icp)
    objects = ObjectClouds.load(options.objects, options.source)
    outputs = [options.out, options.candidates, options.timings]
    with record_provenance(outputs, [options.objects], options.settings, seed=options.seed):
        causes, tally, icp_seconds_S = draw_causes(objects, options.source, options.seed, settings)
        causes.save(options.out)
        tally.save(options.candidates)
        write_timings(options.timings, causes.registrations, icp_seconds_S, icp_seconds_S)
