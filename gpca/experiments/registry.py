"""All experiments, by their folders, and their tables and figures: a new folder is found at the next call."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from gpca import reporting
from gpca.experiments.experiment import Experiment
from gpca.experiments.step import Step
from gpca.reporting.registry import Names, Result, read_results

REGISTRY = Path(reporting.__file__).with_name("results.yaml")


@cache
def experiments() -> tuple[Experiment, ...]:
    """Return the experiments, by their names."""
    folder = Path(__file__).parent
    modules = {path.parent.name: f"{path.parent.name}.experiment" for path in folder.glob("*/experiment.py")}
    modules |= {path.stem: path.stem for path in folder.glob("*.py")}
    declared = []
    for _, name in sorted(modules.items()):
        module = import_module(f"{__package__}.{name}")
        if (experiment := getattr(module, "EXPERIMENT", None)) is not None:
            tidy = tuple(function.tidy for function in _declared(experiment, "tidy"))
            declared.append(replace(experiment, tidy=(*experiment.tidy, *tidy)))
    return tuple(declared)


def steps() -> list[Step]:
    """Return the steps that experiments declare."""
    return [
        value
        for experiment in experiments()
        for module in _modules(experiment)
        for value in vars(module).values()
        if isinstance(value, Step)
    ]


def _modules(experiment: Experiment) -> list[ModuleType]:
    single = (Path(__file__).parent / f"{experiment.name}.py").is_file()
    names = (experiment.name if single else f"{experiment.name}.experiment", *experiment.beside)
    return [import_module(f"{__package__}.{name}") for name in names]


def _declared(experiment: Experiment, kind: str) -> list[Any]:
    """Return the functions of an experiment's modules that declare a ``result``, or ``tidy`` files."""
    return [
        value
        for module in _modules(experiment)
        for value in vars(module).values()
        if hasattr(value, kind) and getattr(value, "__module__", "") == module.__name__
    ]


@cache
def registered() -> tuple[Result, ...]:
    """Return every entry, section by section, as the first file orders them, and in these by experiment.

    Entries that say which they stand below stand there.
    """
    sections: dict[str, list[Result]] = {}
    for section, results in read_results(REGISTRY):
        sections.setdefault(section, []).extend(results)
    for experiment in experiments():
        if experiment.results.is_file():
            for section, results in read_results(experiment.results):
                sections.setdefault(section, []).extend(results)
        for function in _declared(experiment, "result"):
            sections.setdefault(function.result.section, []).append(function.result)
    for results in sections.values():
        for result in [result for result in results if result.after]:
            results.remove(result)
            names = [other.name for other in results]
            results.insert(names.index(result.after) + 1, result)
    return tuple(result for results in sections.values() for result in results)


def results_of(names: Names) -> list[Result]:
    """Return the tables and figures that a run with these names makes, in the order of the registry.

    Args:
        names: the values for the braces of the registry's patterns; ``source`` lists the sources.
    """
    results = []
    for entry in registered():
        of_entry = [entry.of_source(source) for source in names["source"]] if "{source}" in entry.name else [entry]
        results += [result for result in of_entry if result.is_made(names)]
    return results
