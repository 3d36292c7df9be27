"""The files of a run that readings read, by source and seed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from gpca.alignment.icp import ICPSettings
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.experiments.specification_curve.settings import Reading
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.shifted_sets import ShiftedSets
from gpca.uncertainty.settings import UncertaintySettings

# Reading, and the value of a printed number's counterpart under it: source, method, metric, concept, seed, value.
Row = tuple[Reading, str, str, str, str, int, float]


@dataclass(frozen=True)
class RunFiles:
    """The paths of a run's files.

    Attributes:
        registrations, sets: (source, seed) -> file of the step ``registrations`` or ``shift``.
        predictions, embeddings: (source, method, seed) -> file.
        retrained: (severities, source, seed) -> file of the step ``retrain``, for other severities.
        settings: sections of the config by name, for what a reading leaves as it is.
    """

    registrations: Mapping[tuple[str, int], Path] = field(default_factory=dict)
    sets: Mapping[tuple[str, int], Path] = field(default_factory=dict)
    predictions: Mapping[tuple[str, str, int], Path] = field(default_factory=dict)
    embeddings: Mapping[tuple[str, str, int], Path] = field(default_factory=dict)
    retrained: Mapping[tuple[str, str, int], Path] = field(default_factory=dict)
    settings: Mapping[str, dict] = field(default_factory=dict)

    def section(self, name: str) -> dict:
        """Return a section of the settings; an absent one is empty."""
        return self.settings.get(name) or {}

    def uncertainty(self) -> UncertaintySettings:
        """Return the settings of Monte-Carlo ICP under fixed knobs."""
        runs = {name: value for name, value in self.section("uncertainty").items() if name != "samples"}
        return UncertaintySettings(**runs, icp=ICPSettings(**self.section("icp")))

    def in_distribution(self) -> Iterator[tuple[str, int, ShiftedSets, Registrations]]:
        """Yield source, seed, sets, and the samples like the training's with their embeddings attached."""
        for (source, seed), path in self.sets.items():
            sets = ShiftedSets.load(path, (source, seed))
            yield source, seed, sets, like_the_training(sets)

    def embedded(self, source: str, method: str, seed: int) -> Registrations:
        """Return registrations with the embeddings of a ``{backbone}-{reduction}`` attached."""
        registrations = Registrations.load(self.registrations[source, seed], (source, seed))
        embedding = read_embedding(self.embeddings[source, method, seed], registrations)
        return replace(registrations, attached=embedding)


def like_the_training(sets: ShiftedSets) -> Registrations:
    """Return the training samples of the source's encoder and the test samples like them, with their embeddings."""
    return sets.registrations((sets.set == "in_distribution").nonzero()[0])


def by_source_and_seed(paths: Iterable[Path]) -> dict[tuple[str, int], Path]:
    """Return files named ``…/{source}/seed{seed}.npz`` by source and seed."""
    return {source_method_seed(path)[1:]: path for path in paths}


def by_method(paths: Iterable[Path]) -> dict[tuple[str, str, int], Path]:
    """Return files named ``…/{source}/{method}/seed{seed}.csv``, or by two other names, by these three."""
    return {source_method_seed(path): path for path in paths}


def by_backbone(paths: Iterable[Path]) -> dict[tuple[str, str, int], Path]:
    """Return files named ``…/{source}/{backbone}/{reduction}/seed{seed}.npz`` by source, method and seed."""
    files = {}
    for path in paths:
        backbone, reduction, seed = source_method_seed(path)
        if len(path.parts) < 4:
            raise InputError(path, "is not named …/{source}/{backbone}/{reduction}/seed{number}.npz", "rename it")
        files[path.parts[-4], f"{backbone}-{reduction}", seed] = path
    return files
