"""The classifier's kernel, learning rate and iterations (Table IV)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.errors import require_names
from gpca.experiments.experiment import Experiment, LeftOut, Tidy
from gpca.experiments.kernel_grid.grid import PRINTED, KernelGrid
from gpca.objects.entry import title_of
from gpca.settings import Distinct


@dataclass(frozen=True, kw_only=True)
class Section(KernelGrid):
    """The grid, and the sources whose embeddings it is fitted to."""

    sources: Distinct[str]


def check(config: dict, left_out: LeftOut) -> None:
    """Check the names of the sources."""
    sources = config["kernel_grid"]["sources"]
    require_names("kernel_grid.sources", sources, config["sources"], "source", left_out("sources"))


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the sources, and the kernels of the printed rows that are fitted."""
    grid = config["kernel_grid"]
    printed = [
        kernel
        for kernel, rate, iterations in PRINTED
        if kernel in grid["kernels"] and rate in grid["learning_rates"] and iterations in grid["iterations"]
    ]
    return {"kernel_source": list(grid["sources"]), "printed_kernels": printed}


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the sources."""
    shown_sources = {
        name: {"title": entry["title"], "stand_in": entry["stand_in"]}
        for name, entry in sources.items()
        if name in config["kernel_grid"]["sources"]
    }
    return {
        "kernel_sources": shown_sources,
        "kernel_source_titles": {name: title_of(entry) for name, entry in shown_sources.items()},
    }


EXPERIMENT = Experiment(
    name="kernel_grid",
    sections={"kernel_grid": Section},
    tidy=(
        Tidy(
            "kernels.csv",
            "gpca.experiments.kernel_grid.grid:collect_grids",
            {"files": "kernels/{kernel_source}/seed{seed}.csv"},
        ),
        Tidy(
            "kernel_intervals.csv",
            "gpca.experiments.kernel_grid.intervals:collect_intervals",
            {"prediction_files": "kernel_predictions/{kernel_source}/seed{seed}.csv"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    lists={"kernel_grid.sources": "sources"},
)
