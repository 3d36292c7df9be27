"""One file by which the jobs of a rule depend on code, as Snakemake looks at every input of every job."""

import hashlib
import os
from functools import cache
from pathlib import Path
from uuid import uuid4

from gpca.io.files import sha256_of_file
from gpca.process.code_files import code_files

FOLDER = Path(".snakemake/code")  # beside what Snakemake remembers of the files that it made


@cache
def code_stamp(*modules: str) -> str:
    """Write the names and hashes of all :func:`code_files` of modules, and return the file that holds them.

    It changes when one of these does, and not when one is merely touched. The first time it is as old as the newest of
    them, so that what was made before is kept.
    """
    files = code_files(*modules)
    text = "".join(f"{_sha256(file)}  {file}\n" for file in files)
    # In a folder of its own: Snakemake looks into a folder once, and takes what is not yet there to be missing.
    folder = FOLDER / hashlib.sha256(repr(modules).encode()).hexdigest()[:12]
    stamp = folder / modules[0].replace(":", ".")
    is_known = stamp.exists()
    if not is_known or stamp.read_text(encoding="utf-8") != text:
        folder.mkdir(parents=True, exist_ok=True)
        partial = folder / uuid4().hex  # jobs on other machines may write it at the same time
        partial.write_text(text, encoding="utf-8")
        if not is_known:
            time_ns = max(os.stat(file).st_mtime_ns for file in files)
            os.utime(partial, ns=(time_ns, time_ns))
        partial.replace(stamp)
    return str(stamp)


_sha256 = cache(sha256_of_file)
