"""All experiments, their steps, tables and figures: a new file of ``gpca/experiments/`` is found at the next call."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from gpca.declarations.experiment import Experiment
from gpca.declarations.step import Step
from gpca.reporting.registry import Names, Result

PACKAGE = "gpca.experiments"
FOLDER = Path(__file__).parents[1] / "experiments"
BEYOND = "Beyond the paper"
SECTIONS = (  # of the page, the paper's first
    "III Gaussian process concept attribution",
    "IV-A Datasets and controlled perturbations",
    "IV-B Concept attribution accuracy",
    "IV-C Active learning via BALD",
    "IV-D Ablation studies",
    "IV-E Real-world validation",
    "V Robotic deployment for action recovery",
    "What the paper says in sentences",
    "What the paper leaves unstated",
    f"{BEYOND}: what made a registration fail",
    f"{BEYOND}: what explainers look at, and whether it carries over",
    f"{BEYOND}: registration methods",
    f"{BEYOND}: scans registered to scans",
    f"{BEYOND}: how uncertain a pose is",
    f"{BEYOND}: explanations with another method or estimator",
)


@cache
def experiments() -> tuple[Experiment, ...]:
    """All experiments, by their names."""
    declared = []
    for path in sorted(FOLDER.glob("*.py")):
        experiment = getattr(import_module(f"{PACKAGE}.{path.stem}"), "EXPERIMENT", None)
        if experiment is not None:
            tidy = tuple(function.tidy for function in _declared(experiment, "tidy"))
            declared.append(replace(experiment, tidy=(*experiment.tidy, *tidy)))
    return tuple(declared)


def steps() -> list[Step]:
    """Steps that experiments declare."""
    return [value for experiment in experiments() for _, value in _values(experiment) if isinstance(value, Step)]


def _values(experiment: Experiment) -> Iterator[tuple[str, Any]]:
    """Name of a module of the experiment, and each value in it."""
    for name in (experiment.name, *experiment.beside):
        module = import_module(f"{PACKAGE}.{name}")
        yield from ((module.__name__, value) for value in vars(module).values())


def _declared(experiment: Experiment, kind: str) -> list[Any]:
    """Functions of an experiment's modules that declare a ``result``, or ``tidy`` files."""
    found = ((module, value) for module, value in _values(experiment) if hasattr(value, kind))
    return [value for module, value in found if getattr(value, "__module__", "") == module]


@cache
def registered() -> tuple[Result, ...]:
    """All tables and figures, by section and experiment; those that say after which one they come stand there."""
    sections: dict[str, list[Result]] = {section: [] for section in SECTIONS}
    for experiment in experiments():
        for function in _declared(experiment, "result"):
            sections.setdefault(function.result.section, []).append(function.result)
    for results in sections.values():
        for result in [result for result in results if result.after]:
            results.remove(result)
            names = [other.name for other in results]
            results.insert(names.index(result.after) + 1, result)
    return tuple(result for results in sections.values() for result in results)


def results_of(names: Names) -> list[Result]:
    """Tables and figures that a run with these values of names in braces makes, in the order of the page."""
    results = []
    for entry in registered():
        of_entry = [entry.of_source(source) for source in names["source"]] if "{source}" in entry.name else [entry]
        results += [result for result in of_entry if result.is_made(names)]
    return results
