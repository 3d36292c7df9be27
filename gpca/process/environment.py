"""What this machine lacks: Python packages of extras, and the system libraries that Open3D needs."""

from __future__ import annotations

import re
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from gpca.errors import InputError

if TYPE_CHECKING:
    import numpy as np

MODULES = {  # extra of pyproject.toml -> modules of its packages, which `gpca explain` does without
    "suite": (
        *("gpytorch", "llvmlite", "manifold3d", "numba", "open3d", "pandas", "PIL", "pooch", "requests", "SALib"),
        *("skactiveml", "sklearn", "shap", "shapely", "torch", "trimesh", "umap"),
    ),
    "workflow": ("docutils", "jinja2", "markupsafe", "matplotlib", "snakemake"),
}


def remedy(extra: str) -> str:
    """Return how to install the packages of an extra."""
    return f"install it, 'pip install \".[{extra}]\"' in the folder of the suite"


def missing(fault: ModuleNotFoundError) -> str | None:
    """Return a line about the missing package of an extra; None for another module."""
    module = (fault.name or "").partition(".")[0]
    extra = next((name for name, modules in MODULES.items() if module in modules), None)
    return extra and f"{module}: this Python package is not installed; {remedy(extra)}"


def system_library_hint(message: str) -> str | None:
    """Return a remedy for the dynamic linker's message, None if it names no missing shared library."""
    match = re.search(r"(\S+\.so[.\d]*): cannot open shared object file", message)
    return match and f"install the system package that provides {match[1]} (docs/troubleshooting.md)"


def require_open3d() -> ModuleType:
    """Import and return Open3D; the line of an InputError names the extra, or the missing system library."""
    unused = [name for name in ("open3d.ml", "open3d.visualization") if name not in sys.modules]
    sys.modules.update({name: ModuleType(name) for name in unused})
    try:
        import open3d
    except (ImportError, OSError) as fault:
        if isinstance(fault, ModuleNotFoundError) and fault.name == "open3d":
            raise InputError("Open3D", "is not installed", remedy("suite")) from fault
        hint = system_library_hint(str(fault)) or "run 'make environment', on Python 3.11 or 3.12"
        raise InputError("Open3D", f"cannot be imported ({fault})", hint) from fault
    finally:
        for name in unused:  # so that another who asks for them gets them
            del sys.modules[name]
    return open3d


def open3d_cloud(points_N_3: np.ndarray, normals_N_3: np.ndarray | None = None) -> Any:
    """Return Open3D's cloud of points, optionally with normals."""
    import numpy as np  # the pins of the processor precede it

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
