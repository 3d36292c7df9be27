"""Registries: entries by name that the modules of a folder list; and functions by ``module:name``."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, TypeVar

from gpca.errors import require_known
from gpca.process.plugins import entries_outside, imported, is_outside

Entry = TypeVar("Entry")


@dataclass(eq=False)
class Registry(Generic[Entry]):
    """All entries of a kind, such as registration methods; files that are new in the folder need no further listing."""

    kind: str  # name of an entry in messages
    folder: str  # package of the modules that list entries; empty for those elsewhere alone
    variable: str  # of a module, its entries by name
    first: Sequence[str] = ()  # modules elsewhere, whose entries come first,
    last: Sequence[str] = ()  # or after those of the folder
    outside: type[Entry] | None = None  # type of the entries of plugins, which come last; None for no plugins

    def entries(self) -> dict[str, Entry]:
        """Return all entries by name."""
        return {name: entry for entries in self.by_module().values() for name, entry in entries.items()}

    def entry(self, name: str) -> Entry:
        """Return the entry of that name."""
        entries = self.entries()
        require_known(self.kind, name, entries)
        return entries[name]

    def module(self, name: str) -> str:
        """Return the module that lists the entry of that name."""
        self.entry(name)
        return next(module for module, entries in self.by_module().items() if name in entries)

    def by_module(self) -> dict[str, dict[str, Entry]]:
        """Return the entries of each module."""
        folders = import_module(self.folder).__path__ if self.folder else ()
        files = {file for folder in folders for file in os.listdir(folder)}
        names = sorted(f"{self.folder}.{file[:-3]}" for file in files if file.endswith(".py") and file != "__init__.py")
        modules = (*self.first, *names, *self.last)
        by_module = {module: getattr(import_module(module), self.variable, {}) for module in modules}
        if self.outside is None:
            return by_module
        taken = [name for entries in by_module.values() for name in entries]
        return by_module | entries_outside(self.variable, self.kind, self.outside, taken)


def load(name: str) -> Any:
    """Return the function or class that ``module:name`` names."""
    module, _, member = name.partition(":")
    return getattr(imported(module, name) if is_outside(module) else import_module(module), member)
