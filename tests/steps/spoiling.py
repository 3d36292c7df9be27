"""Ways to spoil what a step reads, and what has to come of it: one line, and nothing written or lost."""

import os
import re

import numpy as np

from gpca.io.arrays import save_arrays
from tests.steps.by_words import main
from tests.steps.command_lines import arguments


def content(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def arrays_changed(name, **changed):
    def spoil(folder):
        with np.load(folder / name) as archive:
            arrays = dict(archive)
        save_arrays(folder / name, arrays | {key: change(arrays[key]) for key, change in changed.items()})

    return spoil


def pickled(name):
    def spoil(folder):
        with np.load(folder / name) as archive:
            arrays = {key: archive[key].astype(object) for key in archive.files}
        np.savez(folder / name, **arrays)

    return spoil


def truncated(name):
    return lambda folder: os.truncate(folder / name, (folder / name).stat().st_size // 2)


def removed(name):
    return lambda folder: (folder / name).unlink()


def written(name, text):
    return lambda folder: (folder / name).write_text(text)


def untouched(folder):
    pass


def lines_kept(name, lines):
    return lambda folder: (folder / name).write_text("".join((folder / name).open().readlines()[:lines]))


SAYS_MORE = {"label"}  # steps that speak to a person on stdout


def refused(folder, capsys, step, spoil, changes, message):
    """Assert that a spoilt file or a changed option is refused in one line, and nothing written or lost."""
    spoil(folder)
    before = content(folder)
    assert main(arguments(step, changes)) == 2
    out, err = capsys.readouterr()
    line = err.splitlines()[-1]
    assert line.startswith(f"gpca {step}: ")
    assert re.search(message, line), line
    assert "Traceback" not in err
    assert out == "" or step in SAYS_MORE
    assert content(folder) == before
