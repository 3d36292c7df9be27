"""Command ``compare``: two runs -> a page that sets their tables and figures side by side."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from gpca.errors import InputError
from gpca.experiments.registry import registered
from gpca.io.files import require_outputs
from gpca.page.two_runs import ALONE, APART, DIFFERENT, compare_tables, write_comparison


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the folders and the page."""
    parser.add_argument("one", type=Path, help="folder of a run or a reference, such as results/default")
    parser.add_argument("other", type=Path, help="folder of another run")
    parser.add_argument("--out", type=Path, default=Path("compare.html"), help="the page (default: compare.html)")


def run(options: Namespace) -> int:
    """Write the page, and print how many numbers of each table differ."""
    if options.settings:
        raise InputError("--settings", "is not used by compare", "leave it out")
    folders = (options.one, options.other)
    for folder in folders:
        if not folder.is_dir():
            raise InputError(folder, "no such folder", "name the folder of a finished run, such as results/default")
    require_outputs([options.out])
    titles = {result.name: result.title for result in registered()}
    tables, alone = compare_tables(folders, titles)
    write_comparison(folders, tables, alone, titles, options.out)
    width = max((len(table.name) for table in tables), default=0)
    for table in tables:
        differing = sum(table.counts.get(kind, 0) for kind in (DIFFERENT, APART, ALONE))
        words = f"{differing} of {sum(table.counts.values())} entries differ" if differing else "the same"
        words += f", {apart} with intervals apart" if (apart := table.counts.get(APART, 0)) else ""
        print(f"{table.name:<{width}}  {words}")
    for folder, names in zip(folders, alone, strict=True):
        if names:
            print(f"only in {folder}: {', '.join(names)}")
    print(options.out)
    return 0
