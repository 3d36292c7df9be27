"""The seconds that explainers take to learn and to explain, which differ from run to run and are kept apart."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.experiments.controls.settings import PAPER
from gpca.io.csv_file import numbers, read_csv

if TYPE_CHECKING:
    import pandas as pd

ASKED = 12  # registrations that are described once more, by themselves
COLUMNS = ("explainer", "learning_seconds", "seconds")


@dataclass
class Costs:
    """Seconds of the explainers under the paper's protocol; those of other controls are not counted."""

    _learning: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    _asking: dict[str, float] = field(default_factory=dict)
    _explaining: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def learning(self, control: str, explainer: str) -> Iterator[None]:
        """Count the seconds of the body as learning, be it of the explainer or of its own encoder."""
        started = perf_counter()
        yield
        if control == PAPER:
            self._learning[explainer] += perf_counter() - started

    @contextmanager
    def asking(self, explainer: str, count: int) -> Iterator[None]:
        """Count the seconds of the body as measuring and embedding `count` registrations."""
        started = perf_counter()
        yield
        self._asking[explainer] = (perf_counter() - started) / count

    def explained(self, control: str, explainer: str, seconds_N: np.ndarray) -> None:
        """Count the mean seconds of explaining, with all measurements made."""
        if control == PAPER:
            self._explaining[explainer] = float(seconds_N.mean())

    def rows(self) -> pd.DataFrame:
        """Return `COLUMNS` of each explainer that reads bare registrations."""
        import pandas as pd

        records = [
            (name, self._learning[name], asking + self._explaining[name]) for name, asking in self._asking.items()
        ]
        return pd.DataFrame(records, columns=list(COLUMNS))


def collect_costs(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy ``learning_seconds`` and ``seconds`` (of one registration) of every source, explainer and seed.

    Args:
        files: named ``…/{source}/controls/seed{seed}.csv``.

    Raises:
        InputError: a file that cannot be read, or holds seconds that are none.
    """
    records = []
    for path in files:
        source, _, seed = source_method_seed(path)
        rows = read_csv(path, COLUMNS)
        for metric in COLUMNS[1:]:
            of_explainer = zip(rows["explainer"], numbers(path, rows, metric, least=0), strict=True)
            records += [("costs", source, name, metric, ALL, seed, float(value)) for name, value in of_explainer]
    return tidy(records, "costs of the controls")
