"""Table VI from other rows on depth frames than the judged ones: encoders as published, ICP from estimators' poses.

The run has their predictions (``real_world.published`` and ``conditions`` of the config), so nothing is trained here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.experiments.specification_curve.frames import of_objects, values
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.dataset import Registrations

Place = tuple[str, str]  # source and method of predictions


def encoders(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the judged rows, and of the rows whose encoders are as published in their place."""
    published = run_files.section("published")

    def place(architecture: str, source: str, method: str) -> Place | None:
        encoder, reduction = method.split("-")
        if architecture == "judged":
            return source, method
        return (source, f"{published[encoder]}-{reduction}") if encoder in published else None

    yield from _rows(run_files, readings, "architecture", place)


def starts(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the judged rows, and of the same rows where ICP starts at estimators' poses."""
    estimated = run_files.section("frames")["estimated"]

    def place(initial_pose: str, source: str, method: str) -> Place | None:
        return (source if initial_pose == "true_pose" else estimated), method

    yield from _rows(run_files, readings, "initial_pose", place)


def _rows(
    run_files: RunFiles, readings: Sequence[Reading], choice: str, place: Callable[[str, str, str], Place | None]
) -> Iterator[Row]:
    """Yield what each reading's rows give in the place of the judged ones; those that the run lacks are left out."""
    frames = run_files.section("frames")
    shown = _Shown(run_files)
    for method in frames["methods"]:
        for reading in readings:
            found = place(reading[choice], frames["source"], method)
            seeds = [seed for source, name, seed in run_files.predictions if (source, name) == found]
            for seed in seeds:
                source, name = found  # type: ignore[misc]
                true_S, of_S = shown.test_samples(source, seed, reading["objects"])
                if not of_S.any():
                    continue
                rows = read_predictions(run_files.predictions[source, name, seed])
                named_S = rows.loc[rows["split"] == "test", "concept_predicted"].to_numpy()
                for (metric, concept), value in values(true_S[of_S], named_S[of_S]).items():
                    yield reading, frames["source"], method, metric, concept, seed, value


class _Shown:
    """Keeps the labels of test samples, and which of them show what kind of objects, without their clouds."""

    def __init__(self, run_files: RunFiles) -> None:
        self._run_files = run_files
        self._kept: dict[tuple[str, int], tuple[np.ndarray, dict[str, np.ndarray]]] = {}

    def test_samples(self, source: str, seed: int, objects: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the true concepts (S,) of the test samples, and which of them (S,) show `objects`."""
        if (source, seed) not in self._kept:
            registrations = Registrations.load(self._run_files.registrations[source, seed], (source, seed))
            kinds = {which: of_objects(registrations, which) for which in ("all", "seen", "unseen")}
            self._kept[source, seed] = registrations.concept[registrations.rows("test")], kinds
        true_S, kinds = self._kept[source, seed]
        return true_S, kinds[objects]
