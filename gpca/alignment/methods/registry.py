"""Every registration method by name, one or several per file of this folder, and those that the re-enactment has."""

from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from gpca.alignment.methods.interface import FailedRegistration, MethodEntry, Outcome, Pair
from gpca.errors import InputError
from gpca.io.arrays import require_numbers
from gpca.process.environment import require_open3d
from gpca.process.registry import Registry
from gpca.settings import require_arguments

# Includes methods whose package is missing.
REENACTMENT = ("gpca.reenactment.registration",)
REGISTRY = Registry("registration method", __package__, "METHODS", last=REENACTMENT, outside=MethodEntry)
methods, method_entry, method_module = REGISTRY.entries, REGISTRY.entry, REGISTRY.module


def left_out(names: Iterable[str]) -> dict[str, str]:
    """Return the methods that cannot run here, each with its missing package."""
    packages = {name: method_entry(name).package for name in names}
    return {name: package for name, package in packages.items() if package and find_spec(package) is None}


def installed(names: Iterable[str]) -> list[str]:
    return [name for name in names if not left_out([name])]


def require_settings(name: str, settings: Mapping[str, object]) -> None:
    require_arguments(f"registration method '{name}'", method_entry(name).align, 1, settings)


def require_global(name: str) -> None:
    if not method_entry(name).is_global:
        known = ", ".join(other for other, entry in methods().items() if entry.is_global)
        raise InputError(f"registration method '{name}'", "needs an initial pose", f"choose one of {known}")


def require_local(name: str) -> None:
    if method_entry(name).is_global:
        remedy = "choose one that starts at an initial pose"
        raise InputError(f"registration method '{name}'", "is global, so its results have no spread", remedy)
    _require_package(name, "install it or choose another")


def _require_package(name: str, remedy: str) -> None:
    for package in left_out([name]).values():
        raise InputError(f"registration method '{name}'", f"needs the package {package}", remedy)


def make_method(name: str, settings: Mapping[str, object] | None = None) -> Callable[[Pair], Outcome]:
    """Return a method as a function from pairs to outcomes, in one thread, as Open3D sums in the order of threads."""
    from threadpoolctl import ThreadpoolController

    settings = dict(settings or {})
    require_settings(name, settings)
    _require_package(name, "install it or leave the method out")
    entry = method_entry(name)
    quiet: Any = nullcontext
    if not entry.points_only:
        utility = require_open3d().utility  # loads the thread pools that are limited below
        # Its warnings go to standard output, and repeat the outcome.
        quiet = partial(utility.VerbosityContextManager, utility.VerbosityLevel.Error)
    threads = ThreadpoolController()

    def register(pair: Pair) -> Outcome:
        try:
            with threads.limit(limits=1), quiet():
                outcome = entry.align(pair, **settings)
            if not isinstance(outcome, Outcome):
                fault = f"returns a {type(outcome).__name__}"
                raise InputError(f"registration method '{name}'", fault, "make it return an Outcome")
            subject = f"registration method '{name}': its pose"
            if not np.isfinite(require_numbers(outcome.T_target_source, (4, 4), subject, finite=False)).all():
                raise FailedRegistration("the pose is not finite")
        except FailedRegistration as failure:
            return Outcome(np.array(pair.T_target_source_init, np.float64), 0.0, 0.0, str(failure))
        return outcome

    return register
