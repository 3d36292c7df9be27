"""Write docs/cli.md, the reference of the command line, from what the commands declare.

    python docs/cli.py            # writes the page
    python docs/cli.py --check    # writes nothing; the exit status is 1 if the page is out of date

The text is the commands' own help, so edit that.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from gpca.__main__ import COMMANDS, add_common_arguments, load_command  # noqa: E402 (the script runs from a plain checkout)
from gpca.io.files import whole_file  # noqa: E402

PAGE = Path(__file__).with_name("cli.md")
HEAD = """\
# Command line

<!-- Made by `python docs/cli.py` from what the commands declare; edit their help instead. -->

`gpca` and `python -m gpca` are the same. Results go to stdout, everything else to stderr. A mistake gives one line and
exit status 2 (`check-config` lists all mistakes); a failed check gives status 1. `gpca --version` prints the version.
The steps of the workflow are [targets of Snakemake](../README.md#parts-of-a-run), not commands.
"""


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if the page is out of date")
    check = parser.parse_args(arguments).check
    text = page()
    if PAGE.is_file() and PAGE.read_text(encoding="utf-8") == text:
        return 0
    print(f"{PAGE.relative_to(ROOT)}: {'is out of date' if check else 'written anew'}")
    if not check:
        with whole_file(PAGE) as partial:
            partial.write_text(text, encoding="utf-8")
    return int(check)


def page() -> str:
    """Return the page: a table of the options of every command, then one for each command."""
    common = argparse.ArgumentParser(add_help=False)
    add_common_arguments(common)
    sections = [HEAD, "## Options of every command\n", table(common)]
    for name, summary in COMMANDS.items():
        command = argparse.ArgumentParser(add_help=False)
        load_command(name)[0](command)
        sections += [f"## gpca {name}\n", f"{sentence(summary)}\n", f"`{usage(name, command)}`\n", table(command)]
    return "\n".join(sections)


def usage(name: str, command: argparse.ArgumentParser) -> str:
    """Return the command with the arguments that it needs; `[options]` stands for the others."""
    needed = [words_of(action) for action in command._actions if action.option_strings and action.required]
    positional = [words_of(action) for action in command._actions if not action.option_strings]
    return " ".join(["gpca", name, *positional, *needed, "[options]"])


def words_of(action: argparse.Action) -> str:
    """Return an argument as it is written on the command line."""
    name = str(action.metavar or action.dest)
    value = name.upper() if action.option_strings else name
    many = {"+": f"{value} …", "*": f"[{value} …]", "?": f"[{value}]", 0: ""}
    written = many.get(action.nargs, value) if action.nargs is not None else value
    return " ".join(filter(None, [*action.option_strings[-1:], written]))


def table(command: argparse.ArgumentParser) -> str:
    """Return a Markdown table of the arguments, in the order in which the command declares them."""
    rows = [["argument", "meaning"], ["---", "---"]]
    rows += [[f"`{words_of(action)}`", meaning(action)] for action in command._actions]
    return "".join(f"| {' | '.join(map(escaped, row))} |\n" for row in rows)


def meaning(action: argparse.Action) -> str:
    """Return the help of an argument, with its choices and whether it is required."""
    chosen = one_of(action.choices) if action.choices else ""
    needed = "required" if action.option_strings and action.required else ""
    return "; ".join(filter(None, [(action.help or "").replace("%%", "%"), chosen, needed]))


def one_of(choices: Iterable[str]) -> str:
    """Return the values that an argument takes, in words."""
    return f"one of {', '.join(f'`{choice}`' for choice in choices)}"


def sentence(summary: str) -> str:
    """Return the summary of a command as a sentence."""
    return f"{summary[0].upper()}{summary[1:]}."


def escaped(cell: str) -> str:
    """Return a cell without characters that would end it or read as HTML."""
    return cell.replace("|", "\\|").replace("<", "&lt;")


if __name__ == "__main__":
    sys.exit(main())
