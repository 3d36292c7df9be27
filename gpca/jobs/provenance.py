"""The provenance of results: a JSON file beside every output."""

import hashlib
import json
import os
import platform
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from gpca.errors import InputError
from gpca.io.files import require_outputs, sha256_of_file, write_text
from gpca.io.structured_text import read_json
from gpca.process.code_files import ROOT
from gpca.process.processor import describe

LIBRARIES = ("numpy", "scipy", "torch", "gpytorch", "open3d-cpu", "scikit-learn", "numba", "trimesh", "snakemake")
RECORD = ".provenance.json"  # end of the name of a record
DEVICE = ("vendor", "family", "model", "instructions", "name", "gpu")
_FIELDS: Mapping[str, type] = {
    **dict.fromkeys(("code", "config_sha256", "device", "libraries"), dict),
    **dict.fromkeys(("environment_lock_sha256", "python"), str),
}
Paths = Sequence[Path | str]
CONFIG_VARIABLE = "GPCA_CONFIG_SHA256"  # hash of each section, JSON, for jobs


@contextmanager
def record_provenance(
    outputs: Paths, inputs: Paths, settings: Mapping, seed: int | None = None, folders: bool = False
) -> Iterator[dict]:
    """Time the block, which may add to the record, and write ``<output>.provenance.json`` beside each output."""
    require_outputs(outputs, inputs, folders)
    started, added = time.perf_counter(), {}  # type: ignore[var-annotated]
    yield added
    torch = sys.modules.get("torch")
    versions = {}
    for library in LIBRARIES:
        with suppress(PackageNotFoundError):
            versions[library] = version(library)
    record = added | {
        "seconds": round(time.perf_counter() - started, 3),
        "peak_memory_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1),
        "seed": seed,
        "settings": settings,
        "settings_sha256": sha256_of_settings(settings),
        "config_sha256": json.loads(os.environ.get(CONFIG_VARIABLE, "null")),
        "inputs_sha256": {str(path): sha256_of_file(path) for path in inputs},
        "code": _code_version(),
        "environment_lock_sha256": sha256_of_file(lock) if (lock := ROOT / "environment.lock").is_file() else None,
        "device": describe()
        | {"gpu": torch.cuda.get_device_name() if torch is not None and torch.cuda.is_available() else None},
        "python": platform.python_version(),
        "libraries": versions,
    }
    for output in map(Path, outputs):
        write_text(record_path(output), json.dumps(record, indent=1, sort_keys=True) + "\n")


def record_path(path: Path) -> Path:
    return path.with_name(path.name + RECORD)


def read_record(path: Path) -> dict[str, Any]:
    """Return the provenance record of a file, empty where there is none; InputError for a damaged one."""
    record, remedy = record_path(path), f"make {path.name} again"
    if not os.path.lexists(record):
        return {}
    content = read_json(record, "a provenance record", remedy)
    for name, kind in _FIELDS.items():
        content[name] = kind() if content.get(name) is None else content[name]
        if not isinstance(content[name], kind):
            raise InputError(record, f"'{name}' is no {kind.__name__}", remedy)
    texts = [each for name in ("config_sha256", "libraries", "code") for each in content[name].values()]
    texts += [content["device"].get(name) for name in DEVICE]
    if not all(isinstance(text, str | bool | None) for text in texts):
        raise InputError(record, "has numbers or lists in the place of texts", remedy)
    return content


def sha256_of_settings(settings: object) -> str:
    """Return the SHA-256 of settings as JSON with sorted keys."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()


def _code_version() -> dict[str, object]:
    """Return the version, the commit, and whether tracked files differ; null where git does not track this package."""
    # No import statement: it would make gpca/__init__.py code of every step, and a new version rerun all of them.
    installed = import_module("gpca").__version__
    commit, changes = None, None
    if shutil.which("git") and _git("ls-files", "--error-unmatch", "gpca/__init__.py") is not None:
        commit, changes = _git("rev-parse", "HEAD"), _git("status", "--porcelain", "--untracked-files=no")
    if not commit or changes is None:
        return {"version": installed, "commit": None, "dirty": None}
    return {"version": installed, "commit": commit, "dirty": bool(changes)}


def _git(*arguments: str) -> str | None:
    done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=False)
    return None if done.returncode else done.stdout.strip()
