"""Files of laser scanners, read by packages that the suite does not install: LAS and LAZ by laspy, E57 by pye57."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from gpca.errors import InputError
from gpca.io.limits import require_file

PACKAGES = {".las": "laspy", ".laz": "laspy", ".e57": "pye57"}
INSTALL = {"laspy": "pip install 'laspy[lazrs]'", "pye57": "pip install pye57"}
CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")


def read_scanner_file(path: Path) -> np.ndarray:
    """Return the points (P, 3) float64 of a file of one of the formats in `PACKAGES`, by its suffix.

    All scans of an E57 file are joined in the frame of the file.

    Raises:
        InputError: no such file, a missing package (the line says how to install it), or a file that it cannot read.
    """
    require_file(path, "no such file", "give a LAS, LAZ or E57 file")
    name = PACKAGES[path.suffix.lower()]
    module = _package(name, path)
    try:
        return np.asarray(READERS[name](module, path), np.float64)
    except InputError:
        raise
    except Exception as fault:  # of many kinds, some from C++
        remedy = INSTALL[name] if "LazBackend" in str(fault) else "export it again, or as PLY"
        raise InputError(path, f"cannot be read ({fault})", remedy) from fault


def _package(name: str, path: Path) -> ModuleType:
    try:
        return import_module(name)
    except ImportError as fault:
        raise InputError(path, f"needs the package {name}, which is not installed", INSTALL[name]) from fault


def _las(laspy: ModuleType, path: Path) -> np.ndarray:
    return laspy.read(path).xyz


def _e57(pye57: ModuleType, path: Path) -> np.ndarray:
    file = pye57.E57(str(path))
    try:
        if not file.scan_count:
            raise InputError(path, "holds no scan", "export it again")
        scans = [file.read_scan(number, ignore_missing_fields=True) for number in range(file.scan_count)]
    finally:
        file.close()
    return np.concatenate([np.stack([scan[axis] for axis in CARTESIAN], axis=1) for scan in scans])


READERS: dict[str, Callable[[ModuleType, Path], np.ndarray]] = {"laspy": _las, "pye57": _e57}
