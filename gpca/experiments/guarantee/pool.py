"""All registrations with measured causes that have a state, of all sources and seeds, dealt into parts by families."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gpca.causes.dataset import Causes, labeled
from gpca.causes.descriptors import Descriptors
from gpca.causes.truth import BORDERLINE
from gpca.errors import InputError
from gpca.experiments.guarantee.scored import Scored
from gpca.guarantee.guarantee import states_of
from gpca.io.arrays import REGENERATE
from gpca.io.files import Axes
from gpca.pairs.dataset import Registrations
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.seeds import generator

PARTS = 3  # of families that no file deals into folds
SEVERITIES = ("severity_noise", "severity_rotation_rad", "severity_translation", "severity_crop")
Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Pool:
    """N registrations of all sources and seeds.

    Attributes:
        registrations: with their labels, and with all that explainers read attached.
        source, seed, split, sample, state: (N,) as in the files of causes.
        part: (N,) that of the family; families of one part are learned from together.
    """

    registrations: Registrations
    source: np.ndarray
    seed: np.ndarray
    split: np.ndarray
    sample: np.ndarray
    state: np.ndarray
    part: np.ndarray

    @property
    def family(self) -> np.ndarray:
        """(N,) family of shapes."""
        return self.registrations.cluster

    @property
    def severity(self) -> np.ndarray:
        """(N,) the largest severity of any cause, as a share of the most in any sample."""
        each_N_4 = np.column_stack([getattr(self.registrations, name) for name in SEVERITIES])
        return (each_N_4 / np.maximum(each_N_4.max(axis=0), 1e-12)).max(axis=1)

    def scored(self, rows: np.ndarray, model: str, taught_N: np.ndarray, scores_N_4: np.ndarray) -> Scored:
        """Return rows, row numbers n, of the pool with the scores that a model gave them.

        Args:
            taught_N, scores_N_4: of the n rows.
        """
        names = zip(self.split[rows], self.sample[rows], strict=True)
        return Scored(
            model=np.full(len(rows), model),
            source=self.source[rows],
            seed=self.seed[rows],
            sample=np.array([f"{split} {number}" for split, number in names]),
            family=self.family[rows],
            state=self.state[rows],
            taught=taught_N,
            severity=self.severity[rows],
            weight=np.ones(len(rows)),
            scores=scores_N_4,
        )


def read_pool(causes_files: Sequence[Path], descriptors: Sequence[Path], reenactments: Sequence[Path]) -> Pool:
    """Read the registrations of every source and seed, in the order of the files, which is the same in all three lists.

    Raises:
        InputError: a file that is missing, damaged, or of other samples.
    """
    parts, columns = [], []
    for path, described, enacted in zip(causes_files, descriptors, reenactments, strict=True):
        causes = Causes.load(path)
        source, seed = axes_of(causes.registrations, path)
        state = states_of(causes.truth)
        rows = np.flatnonzero(state != BORDERLINE)
        registrations = _with_measurements(causes, described, enacted).subset(rows)
        parts.append(registrations)
        own = {"split": registrations.split, "sample": registrations.sample, "state": state[rows]}
        columns.append(own | {"source": np.full(len(rows), source), "seed": np.full(len(rows), seed)})
    registrations = Registrations.joined(parts)
    whole = {name: np.concatenate([own[name] for own in columns]) for name in columns[0]}
    return Pool(registrations, **whole, part=parts_of(registrations.cluster, registrations.fold))


def axes_of(registrations: Registrations, path: Path) -> Axes:
    """Return the source and the seed that the file is of; InputError where it does not say."""
    if registrations.axes is None:
        raise InputError(path, "does not say of which source and seed it is", REGENERATE)
    return registrations.axes


def _with_measurements(causes: Causes, described: Path, enacted: Path) -> Registrations:
    registrations = labeled(causes)
    reenactments = Reenactments.load(enacted, causes.registrations)
    own = {"verdict": reenactments.verdict, "reenactment": reenactment_features(reenactments)}
    own |= dict(Descriptors.load(described, causes.registrations).groups)
    return replace(registrations, attached={**registrations.attached, **own})


def parts_of(family_N: np.ndarray, fold_N: np.ndarray) -> np.ndarray:
    """Return the part (N,) of each sample's family: its fold, or where no file gives it one, a part that is drawn."""
    folds = {str(family): int(fold) for family, fold in zip(family_N, fold_N, strict=True) if fold >= 0}
    others = sorted({str(family) for family in family_N} - set(folds))
    drawn = generator("guarantee", "parts").permutation(len(others))
    folds |= {family: int(place) % PARTS for family, place in zip(others, drawn, strict=True)}
    return np.array([folds[str(family)] for family in family_N])
