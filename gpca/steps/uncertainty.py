"""Step ``uncertainty``: registrations -> ``uncertainty/{source}/{design}/seed{seed}.npz``, by Monte-Carlo ICP."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.alignment.icp import ICPSettings
from gpca.pairs.dataset import Registrations
from gpca.process.arguments import SEED, per_seed
from gpca.process.provenance import record_provenance
from gpca.settings import checked_with_icp
from gpca.uncertainty.designs import DESIGNS
from gpca.uncertainty.evaluation import design_rows, evaluate_design
from gpca.uncertainty.outcomes import write_seconds
from gpca.uncertainty.settings import UncertaintySettings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names, one of each per seed; ``--settings`` are those of the design and of ICP."""
    parser.add_argument("--design", required=True, choices=sorted(DESIGNS))
    parser.add_argument("--source", required=True)
    parser.add_argument("--seeds", required=True, type=SEED, nargs="+")
    parser.add_argument("--registrations", required=True, type=Path, nargs="+")
    parser.add_argument("--out", required=True, type=Path, nargs="+")
    parser.add_argument("--tables", required=True, type=Path, nargs="+", help="CSVs of the uncertainties")
    parser.add_argument(
        "--timings", required=True, type=Path, nargs="+", help="CSVs of the run times of every condition"
    )


def run(options: Namespace) -> None:
    """Run the design's conditions for the registrations that it covers, seed by seed."""
    given, icp = checked_with_icp(options.settings, "uncertainty", "*")
    samples = given.pop("samples", None)
    settings = UncertaintySettings(**given, icp=ICPSettings(**icp))
    for seed, registrations_path, out, table, timings in per_seed(options, "registrations", "out", "tables", "timings"):
        with record_provenance([out, table, timings], [registrations_path], options.settings, seed=seed):
            registrations = Registrations.load(registrations_path, (options.source, seed))
            chosen = registrations.subset(design_rows(registrations, options.design, samples))
            outcomes, *seconds = evaluate_design(options.design, chosen, options.source, seed, settings)
            outcomes.save(out, (options.source, seed))
            outcomes.write_table(table, DESIGNS[options.design].conditions)
            write_seconds(timings, outcomes, *seconds)
