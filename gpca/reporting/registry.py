"""An entry of the registry of results: a table or figure, what it is called, and what it is made from."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import product
from typing import Any

from gpca.process.registry import load

SUFFIXES = {"tables": ("md", "csv", "json"), "figures": ("png", "pdf")}  # the files of each kind
Names = Mapping[str, Any]  # what stands in braces -> its one value, or the list of its values


@dataclass(frozen=True)
class Input:
    """The source of one argument of a builder."""

    argument: str  # its name
    files: tuple[str, ...]  # patterns below the folder of a run
    read: str = ""  # ``module:function`` that turns the files into the argument; empty for the paths themselves


@dataclass(frozen=True)
class Result:
    """A table or figure."""

    name: str  # of its files, without suffix
    kind: str  # ``tables`` or ``figures``, the folder that it goes to
    section: str  # its place on the page, and the words above and below it
    title: str
    caption: str
    builder: str  # ``module:function`` that makes it
    inputs: tuple[Input, ...]  # the builder's arguments that come from files
    only: Mapping[str, tuple[str, ...]]  # name of a list -> those of its members that are shown
    needs: tuple[str, ...]  # names that must not be empty, besides those of the inputs
    paper: bool  # it is a table or figure of the paper
    after: str = ""  # name of the result of another experiment below which it stands in their section
    source: str = ""  # the one that it is of, where each has its own

    @property
    def modules(self) -> list[str]:
        """The modules that make it: its builder's and its readers'."""
        return [function.split(":")[0] for function in (self.builder, *self.readers.values()) if function]

    @property
    def readers(self) -> dict[str, str]:
        """The function that reads each argument, empty for the paths themselves."""
        return {source.argument: source.read for source in self.inputs}

    def file(self, suffix: str) -> str:
        """Return a path below the folder of a run, e.g. ``tables/table2_per_concept.md``."""
        return f"{self.kind}/{self.name}.{suffix}"

    @property
    def all_files(self) -> list[str]:
        """The paths of all its files; a run asks for the first, and the others come along."""
        return [self.file(suffix) for suffix in SUFFIXES[self.kind]]

    def files(self, names: Names) -> dict[str, list[str] | str]:
        """Return the files of each input, a path where there can be but one."""
        return {source.argument: expand(source.files, self._shown(names)) for source in self.inputs}

    def is_made(self, names: Names) -> bool:
        """Return whether a run with these names makes it: none of those that it takes is empty."""
        shown = self._shown(names)
        patterns = [pattern for source in self.inputs for pattern in source.files]
        return all(shown[name] for name in (*self.needs, *_braced(patterns)))

    @property
    def arguments(self) -> dict[str, str]:
        """The builder's arguments besides the run and what files give."""
        return {"source": self.source} if self.source else {}

    def of_source(self, source: str) -> Result:
        """Return the result of one source, where the name has ``{source}`` in it."""

        def named(text: str) -> str:
            return text.replace("{source}", source)

        inputs = tuple(replace(each, files=tuple(map(named, each.files))) for each in self.inputs)
        return replace(self, name=named(self.name), title=named(self.title), inputs=inputs, source=source)

    def _shown(self, names: Names) -> dict[str, Any]:
        kept = {key: [name for name in names[key] if name in members] for key, members in self.only.items()}
        return {**names, **kept}


def targets(results: Iterable[Result]) -> dict[str, Result]:
    """Return short names for those that begin with a number of the paper's: ``table2``, ``fig5``; the first of each."""
    short: dict[str, Result] = {}
    for result in results:
        if numbered := re.match(r"(table|fig)\d+(?=_)", result.name):
            short.setdefault(numbered[0], result)
    return short


def unknown_target(target: str, known: Iterable[str]) -> str:
    """Return the line that answers a misspelt target: the known ones nearest to it, or all."""
    known = sorted(known)
    near = get_close_matches(target, known, n=3, cutoff=0.5)
    remedy = f"did you mean {' or '.join(near)}?" if near else f"choose one of {', '.join(known)}"
    return f"gpca: target '{target}': there is no such table, figure or stage; {remedy}"


def expand(patterns: tuple[str, ...], names: Names) -> list[str] | str:
    """Return the files of all combinations of the names in braces; a path where none of these is listed."""
    files = []
    listed = [name for name in _braced(patterns) if not isinstance(names[name], str)]
    for pattern in patterns:
        in_pattern = [name for name in _braced([pattern]) if name in listed]
        for values in product(*(names[name] for name in in_pattern)):
            files.append(pattern.format(**{**names, **dict(zip(in_pattern, values, strict=True))}))
    return files if listed or len(patterns) > 1 else files[0]


def build(
    builder: str, readers: Mapping[str, str], files: Mapping[str, Any], arguments: Mapping[str, Any], run: Any
) -> Any:
    """Read the inputs (:attr:`Result.readers`, :meth:`Result.files`) and call the builder: run, inputs, arguments."""
    inputs = {name: load(reader)(files[name]) if reader else files[name] for name, reader in readers.items()}
    return load(builder)(run, **inputs, **arguments)


def _braced(patterns: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(name for pattern in patterns for name in re.findall(r"{(\w+)}", pattern)))
