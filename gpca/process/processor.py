"""The processor: its facts, and the instructions that libraries may use.

OpenBLAS, MKL, NumPy, torch, oneDNN and numba choose their code by the processor, each choice rounds differently, and
ICP turns a last digit into another pose. So all are limited to x86-64-v3 (AVX2 and FMA), and MKL to the only code
that it runs on any vendor's processor; :mod:`gpca.portable` replaces functions that still differ. Open3D, small_gicp
and other libraries are compiled for one level.
"""

import os
import platform
from pathlib import Path

INSTRUCTIONS_VARIABLE = "GPCA_INSTRUCTIONS"  # "native" allows all instructions; results then differ between machines
COMMON_LEVEL = "x86-64-v3"
CPUINFO = Path("/proc/cpuinfo")
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
_REQUIRED_FLAGS = {"avx2", "fma", "bmi1", "bmi2", "f16c", "movbe", "abm"}
_PINS = {
    "OPENBLAS_CORETYPE": "Haswell",
    "MKL_CBWR": "COMPATIBLE",  # for AVX2, MKL takes another branch on AMD than on Intel
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "ATEN_CPU_CAPABILITY": "avx2",
    "ONEDNN_MAX_CPU_ISA": "AVX2",
    "NUMBA_CPU_NAME": COMMON_LEVEL,
    "NUMBA_CPU_FEATURES": "",  # unset, those of the machine would be added
}


def prepare(threads: int = 1) -> None:
    """Set the threads and instructions of this process and its children, before NumPy, torch, numba or Open3D load."""
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, str(threads)))
    pin_instructions()


def pin_instructions() -> str:
    """Limit the libraries that are loaded from now on to the common level, if it :func:`may_pin`; return the level."""
    if not may_pin():
        return "native"
    os.environ.update(_PINS)
    return COMMON_LEVEL


def has_threads() -> bool:
    """Return whether loops of this process are shared out to threads."""
    return os.environ.get("NUMBA_NUM_THREADS", "1") != "1"


def may_pin() -> bool:
    """Return whether the processor has the common level, and the user does not ask for more."""
    return os.environ.get(INSTRUCTIONS_VARIABLE) != "native" and _flags() >= _REQUIRED_FLAGS


def instructions() -> str:
    """Return the level of this process: "x86-64-v3" or "native"."""
    return COMMON_LEVEL if all(os.environ.get(name) == value for name, value in _PINS.items()) else "native"


def cpu_name() -> str:
    """Return the processor's name and its number of cores."""
    return f"{_cpuinfo().get('model name') or platform.processor() or platform.machine()}, {os.cpu_count()} cores"


def describe() -> dict[str, str | list[str] | None]:
    """Return what libraries choose their code by: name, vendor, family, model, vector instructions; None if unknown."""
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
    if not CPUINFO.exists():
        return {}
    first = CPUINFO.read_text(encoding="utf-8").split("\n\n", 1)[0]
    return {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in first.splitlines())}
