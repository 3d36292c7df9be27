"""Step ``describe``: causes -> ``descriptors/{source}/seed{seed}.npz``, what can be measured of each pair."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_timings, write_timings
from gpca.causes.dataset import Causes
from gpca.features.dataset import describe_all
from gpca.features.settings import DescriptorSettings
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import checked_with_icp


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is ``diagnosis.descriptors``, with ``icp`` of ``registrations``."""
    parser.add_argument("--causes", required=True, type=Path)
    parser.add_argument("--causes-timings", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times, including the observed runs")


def run(options: Namespace) -> None:
    """Describe every pair."""
    given, icp = checked_with_icp(options.settings, "diagnosis", "descriptors")
    outputs = [options.out, options.timings]
    with record_provenance(outputs, [options.causes, options.causes_timings], options.settings, seed=options.seed):
        causes = Causes.load(options.causes, (options.source, options.seed))
        seconds_S, icp_seconds_S = read_timings(options.causes_timings, causes.registrations)
        settings = DescriptorSettings(**given)
        described, own_S, own_icp_S = describe_all(causes, options.source, options.seed, settings, ICPSettings(**icp))
        described.save(options.out)
        write_timings(options.timings, causes.registrations, seconds_S + own_S, icp_seconds_S + own_icp_S)
