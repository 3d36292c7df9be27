"""CSVs of seconds of an earlier step that are damaged, or hold what cannot be."""

import pytest

from ...hostile import refusal
from .commands import COMMANDS


def cell(text):
    return lambda lines: [*lines[:3], lines[3].replace("0.5", text, 1), *lines[4:]]


LINES = {
    "NaN": cell("nan"),
    "infinity": cell("inf"),
    "negative": cell("-0.5"),
    "text": cell("long"),
    "empty": cell(""),
    "complex": cell("0.5+1j"),
    "missing column": lambda lines: [line.rsplit(",", 1)[0] for line in lines],
    "unknown column": lambda lines: [f"{line},{i}" for i, line in enumerate(lines)],
    "unknown split": lambda lines: [*lines[:3], lines[3].replace("train", "tset"), *lines[4:]],
    "missing row": lambda lines: lines[:-1],
    "row twice": lambda lines: [*lines, lines[-1]],
    "too wide": lambda lines: [lines[0], *(f"7,{line}" for line in lines[1:])],
    "nothing": lambda lines: [],
    "head alone": lambda lines: lines[:1],
    "binary": lambda lines: ["\udcff\udcfe\0"],
}


@pytest.mark.parametrize("fault", LINES)
@pytest.mark.parametrize("name", ["seconds.csv", "conditions.csv"])
def test_seconds_that_cannot_be_are_refused(fault, name, folder):
    lines = (folder / name).read_text().splitlines()
    text = "".join(f"{line}\n" for line in LINES[fault](lines))
    (folder / name).write_bytes(text.encode("utf-8", "surrogateescape"))
    refusal(COMMANDS[name], folder, name, "make it with snakemake" if fault == "nothing" else "regenerate it")
