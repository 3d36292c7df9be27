"""What an experiment says of itself, so that the config, the workflow, the command line and the page need not know it.

It stands as ``EXPERIMENT`` in ``gpca/experiments/{name}/experiment.py``, which imports nothing heavy. Beside it are
``step.py``, which runs it; ``results.yaml``, its part of the registry of tables and figures; and what makes these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

Explained = Annotated[dict[str, dict | None], Field(min_length=1)]  # settings by explainer, which checks them itself
ByRun = Callable[[Mapping[str, Any], Mapping[str, Mapping]], dict[str, Any]]  # of the config, and of its sources


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """The declaration of an experiment.

    Attributes:
        name: of its section of the config, its file of rules and its files of results.
        folder: of its code, where that is named otherwise.
        summary: files that its step reads -> those that it writes, in a line.
        settings: the type of its section of the config; every key has to be given.
        tidy: its file of tidy numbers.
        needs: names that must not be empty, or a run does without it.
        names: what it adds to the names in the braces of paths (:func:`gpca.experiments.run.names_of`).
        shown: what it adds to what tables and figures are told (:func:`gpca.experiments.run.settings_of`).
        check: refuses, with an InputError, a section that its type allows and that no run can use. It takes the config,
            and the names that the config leaves out of a mapping, by the mapping's key.
        lists: its lists of names, each with the mapping of the config from which names may be left out.
        explainers: it has a mapping ``explainers``, of which any may be left out.
    """

    name: str
    summary: str
    settings: Any
    tidy: str
    folder: str = ""
    needs: tuple[str, ...] = ()
    names: ByRun = lambda config, sources: {}
    shown: ByRun = lambda config, sources: {}
    check: Callable[[dict, Callable[[str], set[str]]], None] = lambda config, left_out: None
    lists: Mapping[str, str] = field(default_factory=dict)
    explainers: bool = False

    @property
    def step(self) -> str:
        """The module that runs it."""
        return f"{__package__}.{self.folder or self.name}.step"

    @property
    def results(self) -> Path:
        """Its part of the registry of tables and figures."""
        return Path(__file__).parent / (self.folder or self.name) / "results.yaml"

    def is_run(self, names: Mapping[str, Any]) -> bool:
        """Return whether a run with these names has it."""
        return all(names[name] for name in self.needs)
