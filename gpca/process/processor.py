"""The processor: which one it is, and which of its instructions the libraries may use.

OpenBLAS, MKL, NumPy, torch, oneDNN and numba choose their code by the processor that they find, and each choice rounds
in its own way; ICP then turns a last digit into another pose. So all are held to one level that every x86-64 machine of
the last ten years has, x86-64-v3 (AVX2 and FMA), and MKL to the only code that it runs on any vendor's processor.

Pins choose the code, but not what an instruction does. ``rsqrtps`` and ``rcpps`` are estimates that each vendor defines
by a table of its own, and MKL starts some of its functions from them at every level. So `gpca.elementary` stands in for
those, Adam is fused, and ``tests/vendor_guard.py`` fails where a step calls one of them. Nor do pins reach Open3D,
small_gicp and other libraries that are compiled for one level, or whatever a plugin brings along.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

# Set this to "native" to give every library the instructions that it likes best: results then differ between machines.
INSTRUCTIONS_VARIABLE = "GPCA_INSTRUCTIONS"
COMMON_LEVEL = "x86-64-v3"
CPUINFO = Path("/proc/cpuinfo")
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
_REQUIRED_FLAGS = {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe", "abm"}
_PINS: Mapping[str, str] = MappingProxyType(
    {
        "OPENBLAS_CORETYPE": "Haswell",
        # MKL answers AVX2 with another branch on AMD than on Intel. The products of the encoders do without it.
        "MKL_CBWR": "COMPATIBLE",
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
        "ATEN_CPU_CAPABILITY": "avx2",
        "ONEDNN_MAX_CPU_ISA": "AVX2",
        "NUMBA_CPU_NAME": COMMON_LEVEL,
        "NUMBA_CPU_FEATURES": "",  # those that the name implies; unset, the ones of the machine would be added
    }
)


def prepare(threads: int = 1) -> None:
    """Set this process's threads and instructions, for itself and all that it starts.

    Call it before NumPy, torch, numba or Open3D is imported: each reads its variables once.
    """
    # Every library's, or Open3D and torch fight over the cores.
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, str(threads)))
    pin_instructions()


def pin_instructions() -> str:
    """Hold the libraries that are loaded from now on to the common level, and return the level: that or "native".

    What the environment says of these libraries is overruled. Where the processor lacks the level, or where
    GPCA_INSTRUCTIONS is "native", nothing is set.
    """
    if os.environ.get(INSTRUCTIONS_VARIABLE) == "native" or not _flags() >= _REQUIRED_FLAGS:
        return "native"
    os.environ.update(_PINS)
    return COMMON_LEVEL


def instructions() -> str:
    """Return the level that this process was held to: "x86-64-v3" or "native"."""
    return COMMON_LEVEL if all(os.environ.get(name) == value for name, value in _PINS.items()) else "native"


def cpu_name() -> str:
    """Return the processor's name and its number of cores."""
    return f"{_cpuinfo().get('model name') or platform.processor() or platform.machine()}, {os.cpu_count()} cores"


def describe() -> dict[str, str | list[str] | None]:
    """Return the facts by which libraries choose their code: name, vendor, family, model, flags of vector instructions.

    A field that the system does not report is None.
    """
    facts = _cpuinfo()
    vector = ("avx", "fma", "amx", "bmi", "f16c", "sse4")
    return {
        "name": cpu_name(),
        "vendor": facts.get("vendor_id"),
        "family": facts.get("cpu family"),
        "model": facts.get("model"),
        "stepping": facts.get("stepping"),
        "flags": sorted(flag for flag in _flags() if flag.startswith(vector)),
        "instructions": instructions(),
    }


def _flags() -> set[str]:
    return set(_cpuinfo().get("flags", "").split())


def _cpuinfo() -> dict[str, str]:
    """Return the fields of the first processor that Linux lists, or none."""
    if not CPUINFO.exists():
        return {}
    first = CPUINFO.read_text(encoding="utf-8").split("\n\n", 1)[0]
    return {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in first.splitlines())}
