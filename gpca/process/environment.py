"""Whether this machine can run the suite: Open3D is the one package that needs libraries of the system.

``python -m gpca.process.environment`` checks it; ``make`` does so after installing ``environment.lock``.
"""

from __future__ import annotations

import re
import sys
from types import ModuleType
from typing import Any

import numpy as np

from gpca.errors import InputError
from gpca.process.extras import remedy

# Shared library -> package (Debian and Ubuntu, Fedora). Any other library is named as it is.
SYSTEM_PACKAGES = {
    "libGL.so.1": ("libgl1", "mesa-libGL"),
    "libX11.so.6": ("libx11-6", "libX11"),
    "libgomp.so.1": ("libgomp1", "libgomp"),
    "libEGL.so.1": ("libegl1", "mesa-libEGL"),
    "libusb-1.0.so.0": ("libusb-1.0-0", "libusb1"),
    "libstdc++.so.6": ("libstdc++6", "libstdc++"),
}


def system_library_hint(message: str) -> str | None:
    """Return the advice for the dynamic linker's `message`, or None if it names no missing shared library."""
    missing = re.search(r"(\S+\.so[.\d]*): cannot open shared object file", message)
    if missing is None:
        return None
    library = missing[1]
    if library not in SYSTEM_PACKAGES:
        return f"install the system package that provides {library}"
    debian, fedora = SYSTEM_PACKAGES[library]
    return f"install {library}: 'apt-get install {debian}' (Debian, Ubuntu) or 'dnf install {fedora}' (Fedora)"


def require_open3d() -> ModuleType:
    """Import and return Open3D.

    Raises:
        InputError: it is not installed or cannot be imported; the line names the extra, or the system library that is
            missing and its package.
    """
    try:
        import open3d
    except (ImportError, OSError) as fault:
        if isinstance(fault, ModuleNotFoundError) and fault.name == "open3d":
            raise InputError("Open3D", "is not installed", remedy("suite")) from fault
        hint = system_library_hint(str(fault)) or "run 'make environment', on Python 3.11 or 3.12"
        raise InputError("Open3D", f"cannot be imported ({fault})", hint) from fault
    return open3d


def open3d_cloud(points_N_3: np.ndarray, normals_N_3: np.ndarray | None = None) -> Any:
    """Return Open3D's cloud of points, with normals where they are given."""
    o3d = require_open3d()
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.asarray(points_N_3, np.float64)))
    if normals_N_3 is not None:
        cloud.normals = o3d.utility.Vector3dVector(np.asarray(normals_N_3, np.float64))
    return cloud


def check() -> None:
    """Raise :class:`InputError` if this machine lacks what the suite needs."""
    if sys.version_info[:2] not in ((3, 11), (3, 12)):
        version = ".".join(map(str, sys.version_info[:3]))
        raise InputError(f"Python {version}", "is not supported", "use Python 3.11 or 3.12")
    require_open3d()


if __name__ == "__main__":
    try:
        check()
    except InputError as fault:
        print(fault, file=sys.stderr)
        sys.exit(2)
