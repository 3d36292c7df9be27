"""Step ``check-reference``: a run's folder and the reference's -> whether they agree. Reruns nothing."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.comparison.reference import check_reference
from gpca.errors import InputError
from gpca.settings import check_settings
from gpca.structured_text import read_mapping

CONFIG = Path("config/config.yaml")  # as seen from the folder of the suite, where its commands are given


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the folders; ``--settings`` replaces keys of the config's section ``reference``."""
    parser.add_argument("folder", type=Path, help="folder of the run, such as results/real")
    parser.add_argument("--reference", type=Path, help="its reference (default: reference/ beside it, same name)")
    parser.add_argument(
        "--config", type=Path, default=CONFIG, help=f"file whose section reference says what agrees (default: {CONFIG})"
    )


def run(options: Namespace) -> int:
    """Print what each file came to; return 0 where all agree, 1 where one differs or is missing."""
    if not options.folder.is_dir():
        raise InputError(options.folder, "no such folder", f"make it with '{_command(options.folder, [])}'")
    reference = options.reference or options.folder.parent / "reference" / options.folder.name
    settings = _section(options.config) | options.settings
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


def _section(config: Path) -> dict:
    """Return the section ``reference`` of a config."""
    if not config.exists():
        raise InputError(config, "no such file", "run this in the folder of the suite, or name the file with --config")
    section = read_mapping(config).get("reference")
    if section is None:
        raise InputError(config, "holds no section reference", f"name another file with --config, as {CONFIG}")
    if not isinstance(section, dict) or not {"tolerances", "half_widths"} <= set(section):
        raise InputError(config, "its section reference lacks tolerances or half_widths", f"complete it as in {CONFIG}")
    return section


def _command(folder: Path, targets: list[str]) -> str:
    """Return the command that makes targets of a run; a table's CSV comes with its Markdown."""
    config = Path("config", f"{folder.name}.yaml")
    option = f" --configfile {config}" if config.is_file() else ""
    return f"snakemake -j2 {' '.join(targets) or 'all'}{option}"
