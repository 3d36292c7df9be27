"""The declaration of an experiment, so that the config, the workflow and the page need not know it.

It stands as ``EXPERIMENT`` in ``gpca/experiments/{name}.py``, which imports nothing heavy, beside its steps, numbers,
tables and figures.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import Field

from gpca.explainers.registry import explainers
from gpca.process.code_files import ROOT
from gpca.reporting.registry import expand

ByName = Annotated[dict[str, dict | None], Field(min_length=1)]  # settings, by name of what checks its own
ByRun = Callable[[Mapping[str, Any], Mapping[str, Mapping]], dict[str, Any]]  # of the config, and of its sources
LeftOut = Callable[[str], set[str]]  # key of a mapping of the config -> names that the config leaves out of it


@dataclass(frozen=True)
class Names:
    """The names that a mapping of the config may have."""

    noun: str  # the word for a thing with such a name
    known: Callable[[], Collection[str]] | None = None  # returns all of them; None where any name may stand


EXPLAINERS = Names("explainer", explainers)


@dataclass(frozen=True)
class Tidy:
    """A file of tidy numbers; a file with a collector is made from other files of the run by a rule of its own."""

    file: str  # its name
    collector: str = ""  # ``module:function`` that returns its rows; empty where another rule writes it
    files: Mapping[str, str] = field(default_factory=dict)  # the collector's arguments -> patterns of files
    rule: str = ""  # name of the rule, if it is not that of the file
    others: tuple[str, ...] = ()  # files that the collector returns besides, each a target of its own
    takes_run: bool = False  # the collector's first argument is the run

    @property
    def all_files(self) -> tuple[str, ...]:
        """All files that its rule writes."""
        return (self.file, *self.others)

    @property
    def target(self) -> str:
        """The rule that collects it."""
        return self.rule or self.file.removesuffix(".csv")

    def inputs(self, names: Mapping[str, Any]) -> dict[str, list[str] | str]:
        """Return the files that the collector is given, by argument."""
        return {argument: expand((pattern,), names) for argument, pattern in self.files.items()}


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """The declaration of an experiment. Keys of the config are paths with dots, such as ``real_world.backbones``."""

    name: str  # of its module, and of its file of rules, if it has one
    beside: tuple[str, ...] = ()  # modules of gpca.experiments that declare further results, numbers and steps of it
    sections: Mapping[str, Any] = field(default_factory=dict)  # of the config -> their types; every key has to be given
    tidy: tuple[Tidy, ...] = ()  # its files of numbers, which every run makes that has the experiment
    needs: tuple[str, ...] = ()  # names that must not be empty, or a run does without it
    names: ByRun = lambda config, sources: {}  # what it adds to those of :func:`gpca.experiments.run.names_of`
    # Refuses, with an InputError, sections that their types allow and that no run can use.
    check: Callable[[dict, LeftOut], None] = lambda config, left_out: None
    optional_entries: Mapping[str, Names] = field(default_factory=dict)  # mappings of which any entry may be false
    switches: Mapping[str, Names] = field(default_factory=dict)  # mappings name -> bool, read as the list of true names
    # Lists and mappings -> the mapping that has their names, of which they lose those that the config leaves out; or a
    # function that returns the names that they lose.
    lists: Mapping[str, str | Callable[[LeftOut], Collection[str]]] = field(default_factory=dict)
    notices: Callable[[Mapping[str, Any]], Iterable[str]] = lambda config: ()  # on stderr when a run begins

    @property
    def has_rules(self) -> bool:
        """Whether the workflow has a file of rules of its name; what a stage or a collector makes needs none."""
        return (ROOT / f"workflow/rules/{self.name}.smk").is_file()

    def is_run(self, names: Mapping[str, Any]) -> bool:
        """Return whether a run with these names has it."""
        return all(names[name] for name in self.needs)
