"""Things found by name: entries that the modules of a folder list, and functions written ``module:name``."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Generic, TypeVar

from gpca.errors import require_known
from gpca.plugins import entries_outside

Entry = TypeVar("Entry")


class Registry(Generic[Entry]):
    """All entries of a kind: registration methods, say. A file that is new in the folder is found at the next call.

    Args:
        kind: what an entry is, as messages call it.
        folder: name of the package whose modules list them.
        variable: of a module, its entries by name; a module without it lists none.
        first: modules elsewhere, whose entries come before those of the folder.
        outside: type of the entries that modules from outside may list too, after all others; None where none may.
    """

    def __init__(
        self, kind: str, folder: str, variable: str, first: Sequence[str] = (), outside: type[Entry] | None = None
    ) -> None:
        self.kind = kind
        self._folder = folder
        self._variable = variable
        self._first = first
        self._outside = outside

    def entries(self) -> dict[str, Entry]:
        """Return all entries by name."""
        return {name: entry for of_module in self.by_module().values() for name, entry in of_module.items()}

    def entry(self, name: str) -> Entry:
        """Return the entry of that name; an unknown one raises an InputError that lists the known."""
        entries = self.entries()
        require_known(self.kind, name, entries)
        return entries[name]

    def module(self, name: str) -> str:
        """Return the module that lists the entry of that name."""
        self.entry(name)
        return next(module for module, entries in self.by_module().items() if name in entries)

    def by_module(self) -> dict[str, dict[str, Entry]]:
        """Return the entries of each module.

        Raises:
            InputError: a module from outside that cannot be used (:mod:`gpca.plugins`).
        """
        files = pkgutil.iter_modules(import_module(self._folder).__path__)
        names = sorted(f"{self._folder}.{file.name}" for file in files)
        own = {name: getattr(import_module(name), self._variable, {}) for name in (*self._first, *names)}
        if self._outside is None:
            return own
        known = [name for entries in own.values() for name in entries]
        return own | entries_outside(self._variable, self.kind, self._outside, known)


def load(name: str) -> Any:
    """Return the function or class that ``module:name`` names."""
    module, _, member = name.partition(":")
    return getattr(import_module(module), member)
