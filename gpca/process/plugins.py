"""Plugins: modules that packages announce, and files or modules under ``plugins`` in a config (docs/adding.md)."""

import json
import os
import re
import sys
import sysconfig
import traceback
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from gpca.errors import InputError
from gpca.io.files import LONGEST_TITLE, is_title

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
NAMED = "GPCA_PLUGINS"  # environment variable: the config's plugins, as a JSON list
ROOTS: dict[str, Path] = {}  # first part of a module's name -> the folder of its import
_INSTALLED = tuple(Path(sysconfig.get_path(name)).resolve() for name in ("purelib", "platlib", "stdlib"))


def use(plugins: Sequence[str]) -> None:
    """Use files (``my_module.py``, relative to the working directory) and modules, here and in all jobs."""
    if not isinstance(plugins, list | tuple) or not all(isinstance(name, str) and name for name in plugins):
        raise InputError(f"{plugins!r}", "is not a list of files or modules", "give one: [my_module.py]")
    for name in plugins:
        module = load(name)
        if not any(hasattr(module, variable) for variable in VARIABLES):
            raise InputError(name, "lists nothing that could be used", f"give it one of {', '.join(VARIABLES)}")
    os.environ[NAMED] = json.dumps(list(plugins))


def named() -> list[str]:
    """Return the files and modules of :func:`use`."""
    return json.loads(os.environ.get(NAMED, "[]"))


def entries_outside(variable: str, kind: str, of: type, taken: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the entries that plugins list in a variable of `GROUPS`, by module."""
    group = next(group for group, variables in GROUPS.items() if variable in variables)
    names, outside = set(taken), {}
    for module_name, module in _modules([group]).items():
        entries = getattr(module, variable, {})
        if not isinstance(entries, Mapping):
            raise InputError(module_name, f"{variable} is not a mapping", f"give names, each with its {of.__name__}")
        for name, entry in entries.items():
            if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z0-9][\w.-]*", name, re.ASCII):
                fault = f"{variable} has the name {name!r}"
                raise InputError(module_name, fault, "use letters, digits and underscores")
            if not isinstance(entry, of):
                raise InputError(module_name, f"{variable}['{name}'] is {_a(type(entry))}", f"make it {_a(of)}")
            title = name if isinstance(entry, str) else getattr(entry, "title", name)
            if not isinstance(title, str) or not is_title(title):
                fault = f"{variable}['{name}'] has the title {repr(title)[:80]}"
                raise InputError(module_name, fault, f"give a line of at most {LONGEST_TITLE} letters")
            if name in names:
                raise InputError(module_name, f"there is another {kind} '{name}'", "choose a name of your own")
            names.add(name)
        if entries:
            outside[module_name] = dict(entries)
    return outside


def _modules(groups: Iterable[str]) -> dict[str, ModuleType]:
    modules = [load(name) for name in named()]
    for package, name in (announced for group in groups for announced in _announced(group)):
        modules.append(imported(name, f"plugin {name} of the package {package}"))
        _remember(modules[-1])
    return {module.__name__: module for module in modules}


def names_outside() -> set[str]:
    """Return the names of all entries of plugins, of any kind."""
    modules = _modules(GROUPS).values()
    return {name for module in modules for variable in VARIABLES for name in getattr(module, variable, {})}


def is_outside(module: str) -> bool:
    """Return whether a module is not part of the suite."""
    return module.partition(".")[0] not in ("gpca", "baselines")


def load(name: str) -> ModuleType:
    """Import a file by its path, or a module that is installed or below the working directory."""
    if not name.endswith(".py"):
        sys.path += [str(Path.cwd())] * (str(Path.cwd()) not in sys.path)  # searched last
        module = imported(name, name)
        if is_outside(name):
            _remember(module)
        return module
    path = Path(name).expanduser().resolve()
    if not path.is_file():
        raise InputError(name, "no such file", "give a Python file relative to the working directory, or a module")
    if not path.stem.isidentifier():
        raise InputError(name, "has a name that Python cannot import", "rename it: letters, digits and underscores")
    loaded = sys.modules.get(path.stem)
    origin = getattr(loaded, "__file__", None) if loaded else getattr(find_spec(path.stem), "origin", None)
    builtin = path.stem if path.stem in sys.builtin_module_names else None  # and None for a folder without code
    other = Path(origin).resolve() if origin else builtin
    if other not in (None, path):
        raise InputError(name, f"has the name of another module, {other}", "rename it")
    sys.path += [str(path.parent)] * (str(path.parent) not in sys.path)
    module = imported(path.stem, name)
    _remember(module)
    return module


def place_in_plugin(fault: BaseException) -> str | None:
    """Return where a plugin failed, and how; None for a fault elsewhere."""
    for frame, line in reversed([*traceback.walk_tb(fault.__traceback__)]):
        if str(frame.f_globals.get("__name__")).partition(".")[0] in ROOTS:
            kind, words = type(fault).__name__, " ".join(str(fault).split())
            return f"{frame.f_code.co_filename}, line {line}: {kind}{': ' * bool(words)}{words}"
    return None


def lone_root(top: str) -> Path | None:
    """Return the folder of a plugin that is a file, with its helper modules; None for an installed package."""
    root = ROOTS.get(top)
    return None if root is None or root in _INSTALLED else root


@cache
def _announced(group: str) -> tuple[tuple[str, str], ...]:
    points = sorted(metadata.entry_points(group=group), key=lambda point: (point.name, point.value))
    return tuple((point.dist.name if point.dist else point.name, point.module) for point in points)


def imported(module: str, subject: str) -> ModuleType:
    """Import a user's module and what it imports; nothing compiled is left in the user's folder."""
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        return import_module(module)
    except InputError:
        raise
    except (Exception, SystemExit) as fault:  # of a user's code
        raise InputError(subject, f"cannot be imported ({type(fault).__name__}: {fault})", "correct it") from fault
    finally:
        sys.dont_write_bytecode = before


def _remember(module: ModuleType) -> None:
    file, parts = getattr(module, "__file__", None), module.__name__.split(".")
    if file is not None:
        path = Path(file).resolve()
        package = path.parent if path.stem == "__init__" else path.with_suffix("")
        ROOTS[parts[0]] = package.parents[len(parts) - 1]


def _a(kind: type) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIOUaeiou' else 'a'} {kind.__name__}"
