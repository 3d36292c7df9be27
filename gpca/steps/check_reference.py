"""Step ``check-reference``: a run's folder and the reference's -> whether they agree. Reruns nothing."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import yaml

from gpca.code_files import ROOT
from gpca.comparison.reference import check_reference
from gpca.errors import InputError
from gpca.settings import check_settings


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the folders; ``--settings`` replaces keys of the config's section ``reference``."""
    parser.add_argument("folder", type=Path, help="folder of the run, such as results/real")
    parser.add_argument("--reference", type=Path, help="its reference (default: reference/ beside it, same name)")


def run(options: Namespace) -> int:
    """Print what each file came to; return 0 where all agree, 1 where one differs or is missing."""
    if not options.folder.is_dir():
        raise InputError(options.folder, "no such folder", f"make it with '{_command(options.folder, [])}'")
    reference = options.reference or options.folder.parent / "reference" / options.folder.name
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    settings = config["reference"] | options.settings
    check_settings(settings, "reference")
    outcomes = check_reference(options.folder, reference, settings["tolerances"], settings["half_widths"])
    width = max(len(outcome.file) for outcome in outcomes)
    for outcome in outcomes:
        print(f"{outcome.file:<{width}}  {outcome.verdict:<8}{outcome.detail}".rstrip())
    agree, differ = (sum(outcome.verdict == verdict for outcome in outcomes) for verdict in ("agrees", "differs"))
    missing = [str(options.folder / outcome.file) for outcome in outcomes if outcome.verdict == "missing"]
    print(f"{options.folder} against {reference}: {agree} agree, {differ} differ, {len(missing)} missing")
    if missing:
        print(f"{len(missing)} missing; make them with: {_command(options.folder, missing)}", file=sys.stderr)
    return 1 if differ or missing else 0


def _command(folder: Path, targets: list[str]) -> str:
    """Return the command that makes targets of a run; a table's CSV comes with its Markdown."""
    config = f"config/{folder.name}.yaml"
    option = f" --configfile {config}" if (ROOT / config).is_file() else ""
    return f"snakemake -j2 {' '.join(targets) or 'all'}{option}"
