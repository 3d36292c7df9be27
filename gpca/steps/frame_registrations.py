"""Step ``frame_registrations``: instances -> ``registrations/{source}/seed{seed}.npz``, and their pose errors."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import replace
from pathlib import Path

from gpca.attribution.predictions import write_timings
from gpca.frames.instances import Instances
from gpca.frames.plausibility import require_of_objects
from gpca.frames.synthesis import FrameSettings, make_frame_registrations
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.synthesis import RegistrationSettings
from gpca.process.arguments import SEED
from gpca.process.provenance import record_provenance
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files and names; ``--settings`` is the config's section ``registrations``, with test_share, occluders."""
    parser.add_argument("--instances", required=True, type=Path)
    parser.add_argument("--objects", required=True, type=Path)
    parser.add_argument("--source", required=True)
    parser.add_argument("--name", help="name of the frames in the files, where it is another than --source")
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--poses", required=True, type=Path, help="CSV of each sample's origin and pose errors")
    parser.add_argument("--timings", required=True, type=Path, help="CSV of the run times of ICP")


def run(options: Namespace) -> None:
    """Perturb and align."""
    given = dict(options.settings)
    own = {name: given.pop(name) for name in ("test_share", "occluders") if name in given}
    check_settings(given, "registrations")
    check_settings(own, "real_world")
    settings = FrameSettings(**own, registration=RegistrationSettings.from_dict(given))
    inputs, name = [options.instances, options.objects], options.name or options.source
    with record_provenance([options.out, options.poses, options.timings], inputs, options.settings, seed=options.seed):
        instances = Instances.load(options.instances, name)
        objects = ObjectClouds.load(options.objects, name)
        require_of_objects(instances, objects, options.instances)
        made = make_frame_registrations(instances, objects, options.source, options.seed, settings)
        registrations, icp_seconds_S, poses = made
        replace(registrations, axes=(name, options.seed)).save(options.out)
        write_csv(options.poses, poses)
        write_timings(options.timings, registrations, icp_seconds_S, icp_seconds_S)
