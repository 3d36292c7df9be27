"""Step ``check-reference``: a run's folder and the reference's -> whether they agree. It reruns nothing."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.comparison.reference import DIFFERENT, MISSING, ROUNDING, VERDICTS, Allowance, check_reference, device_of
from gpca.errors import InputError
from gpca.io.structured_text import read_mapping
from gpca.settings import read_settings

CONFIG = Path("config/config.yaml")  # as seen from the folder of the suite, where its commands are given


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the folders; ``--settings`` replaces keys of the config's section ``reference``."""
    parser.add_argument("folder", type=Path, help="folder of the run, such as results/full")
    parser.add_argument(
        "--reference", type=Path, help="its reference (default: reference/ and the same name, beside the run)"
    )
    parser.add_argument(
        "--config",
        type=Path,
        default=CONFIG,
        help=f"config whose section 'reference' sets the tolerances (default: {CONFIG})",
    )


def run(options: Namespace) -> int:
    """Print the verdict on each file; return 1 where one is different or missing, 0 where rounding explains all."""
    if not options.folder.is_dir():
        raise InputError(options.folder, "no such folder", f"make it with '{_command(options.folder, [])}'")
    reference = options.reference or options.folder.parent / "reference" / options.folder.name
    settings = _section(options.config) | options.settings
    allowance = read_settings(Allowance, settings, "setting" if options.settings else f"{options.config}: setting")
    outcomes = check_reference(options.folder, reference, allowance)
    width = max(len(outcome.file) for outcome in outcomes)
    for outcome in outcomes:
        print(f"{outcome.file:<{width}}  {outcome.verdict:<9}  {outcome.detail}".rstrip())
    of = {verdict: [o.file for o in outcomes if o.verdict == verdict] for verdict in VERDICTS}
    print(f"{options.folder} against {reference}: " + ", ".join(f"{len(of[name])} {name}" for name in VERDICTS))
    if of[ROUNDING] or of[DIFFERENT]:
        for who, folder in (("reference", reference), ("run", options.folder)):
            print(f"{who}: {device_of(folder, outcomes[0].file)}")
    if of[MISSING]:
        command = _command(options.folder, [str(options.folder / file) for file in of[MISSING]])
        print(f"{len(of[MISSING])} missing; make them with: {command}", file=sys.stderr)
    return 1 if of[DIFFERENT] or of[MISSING] else 0


def _section(config: Path) -> dict:
    """Return the section ``reference`` of a config."""
    if not config.exists():
        raise InputError(config, "no such file", "run this in the folder of the suite, or name the file with --config")
    section = read_mapping(config).get("reference")
    if not isinstance(section, dict):
        raise InputError(config, "has no section 'reference'", f"name another file with --config, such as {CONFIG}")
    return section


def _command(folder: Path, targets: list[str]) -> str:
    """Return the command that makes targets of a run; a table's CSV comes with its Markdown."""
    config = Path("config", f"{folder.name}.yaml")
    option = f" --configfile {config}" if config.is_file() else ""
    return f"snakemake -j2 {' '.join(targets) or 'all'}{option}"
