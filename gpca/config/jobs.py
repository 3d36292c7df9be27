"""The environment that the jobs of a run inherit from the process that plans them."""

from __future__ import annotations

import json
import os
import sys
import sysconfig
from collections.abc import Mapping
from pathlib import Path

from gpca.code_files import ROOT
from gpca.process.processor import pin_instructions
from gpca.process.provenance import CONFIG_VARIABLE, sha256_of_settings

# Where data lies, and how results are judged: two runs that differ in nothing else are runs of one config.
OF_NO_RESULT = ("data_dir", "downloads", "comparison", "reference")


def export_to_jobs(config: Mapping, source_folder: str | Path = ROOT) -> None:
    """Set environment variables such that jobs run this Python and this very code, wherever the working directory is.

    PATH begins with this Python's folder: jobs call ``python``, which need not be the one that plans the run where its
    environment is not activated. PYTHONPATH begins with `source_folder`, unless Python looks there anyway; and with
    PYTHONSAFEPATH a ``gpca`` in the working directory, such as that of another checkout, is not taken for it. The
    hashes of the config's sections, but those that no result depends on, are for the provenance. Libraries may use no
    instructions but those of the common level (:mod:`gpca.process.processor`).

    Args:
        config: the whole configuration of the run.
        source_folder: the folder that holds ``gpca`` and ``baselines``, by default that of the package itself.
    """
    sections = {name: sha256_of_settings(value) for name, value in config.items() if name not in OF_NO_RESULT}
    os.environ[CONFIG_VARIABLE] = json.dumps(sections, sort_keys=True)
    _put_first("PATH", Path(sys.executable).parent)
    source_folder = Path(source_folder).resolve()
    if source_folder not in {Path(sysconfig.get_path(name)).resolve() for name in ("purelib", "platlib")}:
        _put_first("PYTHONPATH", source_folder)
    os.environ["PYTHONSAFEPATH"] = "1"
    pin_instructions()


def _put_first(variable: str, folder: Path) -> None:
    """Put a folder at the head of a list of folders, where it stands once however often jobs start jobs."""
    others = [name for name in os.environ.get(variable, "").split(os.pathsep) if name and name != str(folder)]
    os.environ[variable] = os.pathsep.join([str(folder), *others])
