"""One file by which the jobs of a rule depend on code, as Snakemake looks at every input of every job."""

import hashlib
import json
import os
from contextlib import suppress
from functools import cache
from pathlib import Path
from uuid import uuid4

from gpca.io.files import sha256_of_file
from gpca.process.code_files import NAMES, code_files

FOLDER = Path(".snakemake/code")  # beside what Snakemake remembers of the files that it made
REMEMBERED = FOLDER / "imports.json"


@cache
def code_stamp(*modules: str) -> str:
    """Write the names and hashes of all :func:`code_files` of modules, and return the file that holds them.

    It changes when one of these does, and not when one is merely touched. The first time it is as old as the newest of
    them, so that what was made before is kept.
    """
    known = len(_remembered())
    files = code_files(*modules)
    if len(NAMES) > known:
        _write(REMEMBERED, json.dumps(NAMES))
    text = "".join(f"{_sha256(file)}  {file}\n" for file in files)
    # In a folder of its own: Snakemake looks into a folder once, and takes what is not yet there to be missing.
    folder = FOLDER / hashlib.sha256(repr(modules).encode()).hexdigest()[:12]
    stamp = folder / modules[0].replace(":", ".")
    is_known = stamp.exists()
    if not is_known or stamp.read_text(encoding="utf-8") != text:
        _write(stamp, text, None if is_known else max(os.stat(file).st_mtime_ns for file in files))
    return str(stamp)


def _write(path: Path, text: str, time_ns: int | None = None) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.parent / uuid4().hex  # jobs on other machines may write it at the same time
    partial.write_text(text, encoding="utf-8")
    if time_ns is not None:
        os.utime(partial, ns=(time_ns, time_ns))
    partial.replace(path)


def _remembered() -> dict[str, list[str]]:
    """Return what modules import, as an earlier planning found it; a damaged file is made anew."""
    if not NAMES:
        with suppress(OSError, ValueError, AttributeError, TypeError):
            kept = json.loads(REMEMBERED.read_text(encoding="utf-8"))
            NAMES.update({key: [*map(str, names)] for key, names in kept.items()})
    return NAMES


_sha256 = cache(sha256_of_file)
