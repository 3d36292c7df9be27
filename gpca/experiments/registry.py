"""All experiments, by their folders, and their tables and figures: a new folder is found at the next call."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path

from gpca import reporting
from gpca.experiments.experiment import Experiment
from gpca.reporting.registry import Names, Result, read_results

REGISTRY = Path(reporting.__file__).with_name("results.yaml")


@cache
def experiments() -> tuple[Experiment, ...]:
    """Return the experiments, by their names."""
    names = sorted(path.parent.name for path in Path(__file__).parent.glob("*/experiment.py"))
    return tuple(import_module(f"{__package__}.{name}.experiment").EXPERIMENT for name in names)


@cache
def registered() -> tuple[Result, ...]:
    """Return every entry, section by section, as the first file orders them, and in these by experiment.

    Entries that say which they stand below stand there.
    """
    sections: dict[str, list[Result]] = {}
    for path in (REGISTRY, *(each.results for each in experiments())):
        for section, results in read_results(path):
            sections.setdefault(section, []).extend(results)
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
