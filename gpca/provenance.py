"""Where a result comes from: a JSON sidecar beside every output, apart from the data so that those stay comparable."""

from __future__ import annotations

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
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from gpca.files import sha256_of_file, whole_file

LIBRARIES = ("numpy", "scipy", "torch", "gpytorch", "open3d-cpu", "scikit-learn", "numba", "trimesh", "snakemake")
CONFIG_VARIABLE = "GPCA_CONFIG_SHA256"  # set by the Snakefile for its jobs
_ROOT = Path(__file__).resolve().parent.parent


@contextmanager
def record_provenance(
    outputs: Sequence[Path | str], inputs: Sequence[Path | str], settings: Mapping, seed: int | None = None
) -> Iterator[None]:
    """Time the block and, when it succeeds, write ``<output>.provenance.json`` beside each output.

    Args:
        outputs, inputs: files; the inputs are hashed (SHA-256).
        settings: what the result depends on besides its inputs.
        seed: the repeat, if there is one.
    """
    started = time.perf_counter()
    yield
    record = {
        "seconds": round(time.perf_counter() - started, 3),
        "peak_memory_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1),
        "seed": seed,
        "settings": settings,
        "settings_sha256": sha256_of_settings(settings),
        "config_sha256": os.environ.get(CONFIG_VARIABLE),
        "inputs_sha256": {str(path): sha256_of_file(path) for path in inputs},
        "code": _code_version(),
        "environment_lock_sha256": sha256_of_file(_ROOT / "environment.lock"),
        "device": _device(),
        "python": platform.python_version(),
        "libraries": _library_versions(),
    }
    for output in map(Path, outputs):
        with whole_file(output.with_name(output.name + ".provenance.json")) as partial:
            partial.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def sha256_of_settings(settings: Mapping) -> str:
    """Return the SHA-256 of settings as JSON with sorted keys."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()


def _code_version() -> dict[str, object]:
    """The commit and whether tracked files differ from it; nulls outside a git checkout, or without git."""
    if shutil.which("git") is None:
        return {"commit": None, "dirty": None}
    commit, changes = (
        subprocess.run(["git", "-C", str(_ROOT), *arguments], capture_output=True, text=True, check=False)
        for arguments in (("rev-parse", "HEAD"), ("status", "--porcelain", "--untracked-files=no"))
    )
    if commit.returncode or changes.returncode:
        return {"commit": None, "dirty": None}
    return {"commit": commit.stdout.strip(), "dirty": bool(changes.stdout.strip())}


def cpu_name() -> str:
    """Return the processor and its number of cores."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines() if Path("/proc/cpuinfo").exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{models[0] if models else platform.processor()}, {os.cpu_count()} cores"


def _device() -> str:
    """The processor, and the GPU where torch was loaded and uses one."""
    torch = sys.modules.get("torch")
    if torch is None or not torch.cuda.is_available():
        return cpu_name()
    return f"{cpu_name()}, {torch.cuda.get_device_name()}"


def _library_versions() -> dict[str, str]:
    found = {}
    for library in LIBRARIES:
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            continue
    return found
