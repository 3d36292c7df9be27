"""The command ``gpca <command> …``, or ``python -m gpca <command> …``: the commands that people run by hand."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from gpca import __version__
from gpca.errors import InputError
from gpca.jobs.arguments import THREADS, OneLineParser
from gpca.jobs.job import as_process, keep_freed_memory
from gpca.process.processor import prepare

COMMANDS = {  # those for a registration of one's own first, then those for a run
    "explain": "say whether a registration succeeded and, if not, why and what to do",
    "repair": "put a registration right if it is wrong, and say how sure that is",
    "calibrate": "calibrate a model's guarantees on registrations that you have labeled right or wrong",
    "label": "ask a person for the labels that help the classifier most",
    "bench": "run a method of your own on a track, and show its row among the published ones",
    "score": "score predictions made anywhere, and show their row among the published ones",
    "leaderboard": "make a page that ranks submitted predictions",
    "compare": "make a page with the tables and figures of two runs side by side",
    "ship": "make the model of the package and its card from the model of a run",
    "ship-predictions": "extract from a run the predictions and truths that bench and score read",
    "check-config": "check whether a run can use these configs",
    "check-reference": "check whether the numbers of a run agree with its reference",
}
WITH_SETTINGS = ("label", "bench", "check-reference")  # the others use none
MODULES = {  # modules of gpca.commands with several commands; others have the name of their command
    "repair": "explain",
    **dict.fromkeys(("bench", "score", "leaderboard", "ship-predictions"), "tracks"),
    **dict.fromkeys(("compare", "check-config", "check-reference"), "runs"),
}


def load_command(name: str) -> tuple[Callable[[ArgumentParser], None], Callable[[Namespace], int | None]]:
    """Return the functions that declare the arguments of a command and run it."""
    module, suffix = import_module(f"gpca.commands.{MODULES.get(name, name)}"), name.replace("-", "_")
    return getattr(module, f"add_{suffix}_arguments"), getattr(module, f"run_{suffix}")


def main(arguments: list[str] | None = None) -> int:
    """Run one command; a user's mistake ends as one line on stderr and status 2, Ctrl-C as status 130."""
    arguments = sys.argv[1:] if arguments is None else arguments
    chosen = next((argument for argument in arguments if not argument.startswith("-")), None)
    return as_process(f"gpca {chosen}", lambda: _run(arguments, chosen))


def add_common_arguments(command: ArgumentParser) -> None:
    """Declare the arguments of every command."""
    threads = "number of threads for torch, numba and OpenMP (default 1)"
    command.add_argument("--threads", type=THREADS, default=1, help=threads)
    command.add_argument("--settings", default="{}", help="the command's section of the config, as JSON")


def _run(arguments: list[str], chosen: str | None) -> int:
    program = "gpca" if Path(sys.argv[0]).stem == "gpca" else "python -m gpca"
    parser = OneLineParser(prog=program, description="Commands to run by hand; the workflow's steps are its targets.")
    parser.add_argument("--version", action="version", version=f"gpca {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="command")
    for name, summary in COMMANDS.items():
        command = commands.add_parser(name, help=summary, description=summary)
        add_common_arguments(command)
        if name == chosen:  # the others bring libraries that take seconds to load
            early = OneLineParser(prog=program, add_help=False)
            early.add_argument("--threads", type=THREADS, default=1)
            prepare(early.parse_known_args(arguments)[0].threads)  # before any library is loaded
            keep_freed_memory()
            add_arguments, run = load_command(name)
            add_arguments(command)
            command.set_defaults(run=run)
    options = parser.parse_args(arguments)
    from gpca.io.structured_text import parse_json, require_plain

    try:
        options.settings = parse_json(options.settings)
    except ValueError as fault:
        raise InputError("--settings", f"invalid JSON: {fault}", "give a JSON object") from fault
    if not isinstance(options.settings, dict):
        raise InputError("--settings", "not a JSON object", 'give one, such as {"draw_points": 512}')
    require_plain(options.settings, "--settings")
    if options.settings and chosen not in WITH_SETTINGS:
        raise InputError("--settings", f"is not used by {chosen}", "leave it out")
    return options.run(options) or 0


if __name__ == "__main__":
    sys.exit(main())
