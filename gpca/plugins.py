"""Code from outside: modules of installed packages, and files or modules that a config names under ``plugins``.

A module lists what it adds in the variables in which the suite's own modules do, such as ``EXPLAINERS``. An installed
package announces such a module by an entry point, whose group says what is in it::

    [project.entry-points."gpca.explainers"]
    my_package = "my_package.explainers"

What a config names reaches the jobs of a run by an environment variable.
"""

from __future__ import annotations

import json
import os
import sys
import sysconfig
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from gpca.errors import InputError

GROUPS = {  # group of entry points -> variables of its modules
    "gpca.explainers": ("EXPLAINERS", "CAUSE_EXPLAINERS"),
    "gpca.methods": ("METHODS",),
    "gpca.estimators": ("ESTIMATORS",),
    "gpca.encoders": ("ENCODERS",),
    "gpca.strategies": ("STRATEGIES",),
    "gpca.policies": ("POLICIES",),
    "gpca.sources": ("SOURCES",),
}
VARIABLES = tuple(variable for variables in GROUPS.values() for variable in variables)
NAMED = "GPCA_PLUGINS"  # environment variable: what the config names, as a JSON list
ROOTS: dict[str, Path] = {}  # first part of a module's name -> the folder that it is imported from
_INSTALLED = tuple(Path(sysconfig.get_path(name)).resolve() for name in ("purelib", "platlib", "stdlib"))


def use(plugins: Sequence[str]) -> None:
    """Take these files (``my_module.py``, relative to the working directory) and modules, here and in all jobs.

    Raises:
        InputError: no list of names; a file or module that is not there, cannot be imported or lists nothing.
    """
    if not isinstance(plugins, list | tuple) or not all(isinstance(name, str) and name for name in plugins):
        raise InputError(f"{plugins!r}", "is not a list of files or modules", "give one: [my_module.py]")
    for name in plugins:
        module = load(name)
        if not any(hasattr(module, variable) for variable in VARIABLES):
            raise InputError(name, "lists nothing that could be used", f"give it one of {', '.join(VARIABLES)}")
    os.environ[NAMED] = json.dumps(list(plugins))


def named() -> list[str]:
    """Return the files and modules that :func:`use` took."""
    return json.loads(os.environ.get(NAMED, "[]"))


def entries_outside(variable: str, kind: str, of: type, known: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the entries that modules from outside list in a variable, by module.

    Args:
        variable: its name, one of those of `GROUPS`.
        kind: what an entry is, as messages call it.
        of: its type.
        known: names that the suite's own entries have.

    Raises:
        InputError: a variable that is no mapping, an entry of another type, or a name that another one has.
    """
    group = next(group for group, variables in GROUPS.items() if variable in variables)
    taken, found = set(known), {}
    for name, module in _modules(group).items():
        entries = getattr(module, variable, {})
        if not isinstance(entries, Mapping):
            raise InputError(name, f"{variable} is not a mapping", f"give names, each with its {of.__name__}")
        for own, entry in entries.items():
            if not isinstance(entry, of):
                raise InputError(name, f"{variable}['{own}'] is {_a(type(entry))}", f"make it {_a(of)}")
            if own in taken:
                raise InputError(name, f"there is another {kind} '{own}'", "choose a name of your own")
            taken.add(own)
        if entries:
            found[name] = dict(entries)
    return found


def joined_outside(variable: str, kind: str, of: type, own: Mapping[str, Any]) -> dict[str, Any]:
    """Return the suite's own entries of a kind and those from outside, by name."""
    outside = entries_outside(variable, kind, of, own)
    return {**own, **{name: entry for entries in outside.values() for name, entry in entries.items()}}


def module_outside(variable: str, kind: str, of: type, name: str) -> str | None:
    """Return the module from outside that lists a name in a variable; None where none does."""
    return next((module for module, own in entries_outside(variable, kind, of, ()).items() if name in own), None)


def is_outside(module: str) -> bool:
    """Return whether a module is no part of the suite."""
    return module.partition(".")[0] not in ("gpca", "baselines")


def load(name: str) -> ModuleType:
    """Import a file, by its path, or a module that is installed or lies below the working directory.

    Raises:
        InputError: not there, a file whose name another module has, or a fault within it.
    """
    if not name.endswith(".py"):
        _search_also(Path.cwd())
        module = _imported(name, name)
        if is_outside(name):
            _remember(module)
        return module
    path = Path(name).expanduser().resolve()
    if not path.is_file():
        raise InputError(name, "no such file", "give a Python file relative to the working directory, or a module")
    if not path.stem.isidentifier():
        raise InputError(name, "has a name that Python cannot import", "rename it: letters, digits and underscores")
    if (other := _place_of(path.stem)) not in (None, path):
        raise InputError(name, f"has the name of another module, {other}", "rename it")
    _search_also(path.parent)
    module = _imported(path.stem, name)
    _remember(module)
    return module


def lone_root(top: str) -> Path | None:
    """Return the folder of a plugin's file, beside which its helpers may lie; None for an installed package."""
    root = ROOTS.get(top)
    return None if root is None or root in _INSTALLED else root


def _modules(group: str) -> dict[str, ModuleType]:
    """Return the modules that the config names, and those that installed packages announce for a group, by name."""
    modules = [load(name) for name in named()]
    for package, name in _announced(group):
        modules.append(_imported(name, f"plugin {name} of the package {package}"))
        _remember(modules[-1])
    return {module.__name__: module for module in modules}


@cache
def _announced(group: str) -> tuple[tuple[str, str], ...]:
    """Return (package, module) of the entry points of a group, by their names."""
    points = sorted(metadata.entry_points(group=group), key=lambda point: (point.name, point.value))
    return tuple((point.dist.name if point.dist else point.name, point.module) for point in points)


def _imported(module: str, subject: str) -> ModuleType:
    try:
        return import_module(module)
    except InputError:
        raise
    except Exception as fault:  # whatever code of a user's raises
        raise InputError(subject, f"cannot be imported ({type(fault).__name__}: {fault})", "correct it") from fault


def _remember(module: ModuleType) -> None:
    """Note the folder that a module, or the package that it is in, is imported from."""
    file, parts = getattr(module, "__file__", None), module.__name__.split(".")
    if file is not None:
        path = Path(file).resolve()
        package = path.parent if path.stem == "__init__" else path.with_suffix("")
        ROOTS[parts[0]] = package.parents[len(parts) - 1]


def _place_of(stem: str) -> Path | None:
    """Return the file of the module that an import of this name finds; a folder of that name alone is none."""
    loaded = sys.modules.get(stem)
    origin = getattr(loaded, "__file__", None) if loaded else getattr(find_spec(stem), "origin", None)
    if origin is None:
        return Path(stem) if stem in sys.builtin_module_names else None
    return Path(origin).resolve()


def _search_also(folder: Path) -> None:
    """Let imports find what lies in a folder, after everything else."""
    if str(folder) not in sys.path:
        sys.path.append(str(folder))


def _a(kind: type) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIOUaeiou' else 'a'} {kind.__name__}"
