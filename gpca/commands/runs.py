"""Commands for configs and finished runs: ``check-config``, ``check-reference`` and ``compare``."""

import re
import sys
from argparse import ArgumentParser, Namespace
from contextlib import suppress
from functools import reduce
from pathlib import Path

from gpca.errors import InputError

CONFIG = Path("config/config.yaml")  # relative to the folder of the suite
KEY = re.compile(r"config key ([^\s:]+): ")  # before a fault


def add_check_config_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("configs", nargs="*", type=Path, help="config files, merged into the default in this order")


def run_check_config(options: Namespace) -> int:
    """Merge the configs into the default and check the result: all faults are lines on stderr, with status 2."""
    from gpca.config.check import check
    from gpca.config.layers import read_file, with_defaults

    given = {path: read_file(path) for path in options.configs}
    config = with_defaults(*given.values())
    faults: list[str] = []
    sources = check(config, faults)
    if faults:
        firsts: dict[str, str] = {}  # one fault may show at several keys
        for line in faults:
            firsts.setdefault(KEY.sub("", line), f"gpca check-config: {_file_of(line, given)}{line}")
        print(*firsts.values(), sep="\n", file=sys.stderr)
        return 2
    print(f"run {config['run']}: valid; sources {', '.join(sources)}; seeds {', '.join(map(str, config['seeds']))}")
    return 0


def _file_of(line: str, configs: dict[Path, dict]) -> str:
    """Return the last config that has the key of a fault, with a colon; empty where none has it."""
    key = KEY.match(line)
    for path, config in reversed(configs.items()):
        with suppress(LookupError, TypeError):
            reduce(lambda part, name: part[name], (key[1] if key else line).split("."), config)
            return f"{path}: "
    return ""


def add_check_reference_arguments(parser: ArgumentParser) -> None:
    """Declare the folders; ``--settings`` replaces keys of the config's section ``reference``."""
    add = parser.add_argument
    add("folder", type=Path, help="folder of the run, such as results/full")
    add("--reference", type=Path, help="its reference (default: reference/ and the same name, beside the run)")
    config = f"config whose section 'reference' sets the tolerances (default: {CONFIG})"
    add("--config", type=Path, default=CONFIG, help=config)


def run_check_reference(options: Namespace) -> int:
    """Compare a run with its reference file by file; return 1 for different or missing files, otherwise 0."""
    from gpca.comparison import reference as checks
    from gpca.io.structured_text import read_mapping
    from gpca.settings import read_settings

    folder, config = options.folder, options.config
    if not folder.is_dir():
        raise InputError(folder, "no such folder", f"make it with '{_snakemake(folder, [])}'")
    reference = options.reference or folder.parent / "reference" / folder.name
    if not config.exists():
        raise InputError(config, "no such file", "run this in the folder of the suite, or name the file with --config")
    section = read_mapping(config).get("reference")
    if not isinstance(section, dict):
        raise InputError(config, "has no section 'reference'", f"name another file with --config, such as {CONFIG}")
    subject = "setting" if options.settings else f"{config}: setting"
    allowance = read_settings(checks.Allowance, section | options.settings, subject)
    outcomes = checks.check_reference(folder, reference, allowance)
    width = max(len(outcome.file) for outcome in outcomes)
    for outcome in outcomes:
        print(f"{outcome.file:<{width}}  {outcome.verdict:<9}  {outcome.detail}".rstrip())
    files = {verdict: [each.file for each in outcomes if each.verdict == verdict] for verdict in checks.VERDICTS}
    print(f"{folder} against {reference}: " + ", ".join(f"{len(files[name])} {name}" for name in checks.VERDICTS))
    if files[checks.ROUNDING] or files[checks.DIFFERENT]:
        for role, directory in (("reference", reference), ("run", folder)):
            print(f"{role}: {checks.device_of(directory, outcomes[0].file)}")
    if files[checks.MISSING]:
        command = _snakemake(folder, [str(folder / file) for file in files[checks.MISSING]])
        print(f"{len(files[checks.MISSING])} missing; make them with: {command}", file=sys.stderr)
    return 1 if files[checks.DIFFERENT] or files[checks.MISSING] else 0


def _snakemake(folder: Path, targets: list[str]) -> str:
    config = Path("config", f"{folder.name}.yaml")
    option = f" --configfile {config}" if config.is_file() else ""
    return f"snakemake -j2 {' '.join(targets) or 'all'}{option}"


def add_compare_arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("one", type=Path, help="folder of a run or a reference, such as results/default")
    add("other", type=Path, help="folder of another run")
    add("--out", type=Path, default=Path("compare.html"), help="the page (default: compare.html)")


def run_compare(options: Namespace) -> int:
    """Write a page with the tables and figures of two runs, and print how many numbers of each table differ."""
    from gpca.declarations.registry import registered
    from gpca.io.files import require_apart, require_page
    from gpca.page.two_runs import ALONE, APART, DIFFERENT, compare_tables, write_comparison

    folders = (options.one, options.other)
    for folder in folders:
        if not folder.is_dir():
            raise InputError(folder, "no such folder", "name the folder of a finished run, such as results/default")
    require_apart(options, ["out"])
    require_page(options.out)
    titles = {result.name: result.title for result in registered()}
    tables, alone = compare_tables(folders, titles)
    write_comparison(folders, tables, alone, titles, options.out)
    width = max((len(table.name) for table in tables), default=0)
    for table in tables:
        differing = sum(table.kinds.get(kind, 0) for kind in (DIFFERENT, APART, ALONE))
        words = f"{differing} of {sum(table.kinds.values())} entries differ" if differing else "the same"
        words += f", {apart} with intervals apart" if (apart := table.kinds.get(APART, 0)) else ""
        print(f"{table.name:<{width}}  {words}")
    for folder, names in zip(folders, alone, strict=True):
        if names:
            print(f"only in {folder}: {', '.join(names)}")
    print(options.out)
    return 0
