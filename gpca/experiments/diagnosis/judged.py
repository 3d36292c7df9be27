"""Test samples with their truth and an explainer's predictions."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.truth import NOMINAL, Truth, state_of_errors
from gpca.errors import InputError
from gpca.evaluation.measures import source_method_seed
from gpca.io.container import require_same_samples
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    import pandas as pd

CEILING = "ceiling"  # the truth, measured again from other starts: no explainer can be expected to do better
POOLED = "pooled"  # all sources together


@dataclass(frozen=True)
class SampleTruth:
    """N test samples with their truth, without their clouds.

    Attributes:
        truth, truth_again: as of :class:`gpca.causes.dataset.Causes`.
        cluster, symmetric, error_shown: (N,) the same.
    """

    truth: Truth
    truth_again: Truth
    cluster: np.ndarray
    symmetric: np.ndarray
    error_shown: np.ndarray

    @classmethod
    def of(cls, causes: Causes) -> SampleTruth:
        """Return what is kept of registrations that are all for testing."""
        return cls(causes.truth, causes.truth_again, causes.registrations.cluster, causes.symmetric, causes.error_shown)


@dataclass(frozen=True)
class Judged:
    """N test samples with an explainer's predictions.

    Attributes:
        label: one of :data:`gpca.causes.dataset.LABELS`, or ``borderline``.
        instance: the object, views of one instance together. seed: the repeat.
        error: (N, 8) v of every subset of the causes. phi: (N, 3). causes: (N, 3) whether each is one of them.
        tied: (N, 3) whether each adds as much as the dominant one, up to the limit of a cause. margin: between the two
            largest φ.
        shown: state of the registration that the explainer sees, by its own error. symmetric: the error is ADD-S.
        alarm: how wrong the explainer takes the registration to be, larger is worse. scores: (N, 3) of the causes.
        named: the label that it names; empty where it names none.
        nominal: its score of "nominal".
    """

    label: np.ndarray
    instance: np.ndarray
    seed: np.ndarray
    error: np.ndarray
    phi: np.ndarray
    causes: np.ndarray
    tied: np.ndarray
    margin: np.ndarray
    shown: np.ndarray
    symmetric: np.ndarray
    alarm: np.ndarray
    scores: np.ndarray
    named: np.ndarray
    nominal: np.ndarray

    def __len__(self) -> int:
        return len(self.label)

    def subset(self, rows: np.ndarray) -> Judged:
        """Return the given rows, which may be a mask."""
        return Judged(*(getattr(self, field.name)[rows] for field in fields(Judged)))

    @property
    def names_causes(self) -> bool:
        """Whether the explainer says more than whether something is wrong."""
        return bool((self.named != "").any())


def read_judged(
    prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]
) -> dict[tuple[str, str, int], Judged]:
    """Return the test samples of every source, explainer and seed, those of the ceiling first.

    Args:
        prediction_files: named ``…/{source}/{explainer}/seed{seed}.csv``.
        causes_files: named ``…/{source}/seed{seed}.npz``.

    Raises:
        InputError: no files, a file that cannot be read, predictions of other samples.
    """
    truths, judged = {}, {}
    for path in causes_files:
        source, seed = Path(path).parent.name, seed_of_file(path)
        causes = Causes.load(path, (source, seed))
        truths[source, seed] = causes.subset(causes.rows("test"))
        judged[source, CEILING, seed] = ceiling_of(truths[source, seed], seed)
    for path in prediction_files:
        source, explainer, seed = source_method_seed(path)
        if (source, seed) not in truths:
            raise InputError(path, "its ground truth was not given", f"give causes/{source}/seed{seed}.npz")
        rows = read_predictions(path)
        rows = rows[rows["split"] == "test"]
        truth = truths[source, seed]
        require_same_samples(path, rows, truth.registrations.arrays, "causes", ("sample",))
        judged[source, explainer, seed] = judged_by(rows, truth, seed)
    if not judged:
        raise InputError("diagnoses", "no files were given", "name at least one explainer in diagnosis.explainers")
    return judged


def joined(parts: Iterable[Judged]) -> Judged:
    """Return the samples of several one after the other."""
    parts = list(parts)
    return Judged(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Judged)))


def judged_by(rows: pd.DataFrame, truth: Causes, seed: int) -> Judged:
    """Return test samples with the predictions of a file whose rows are in the same order."""
    scores_N_4 = rows[[f"score_{label}" for label in LABELS]].to_numpy(float)
    named_N = np.where(rows["abstained"], "", rows["concept_predicted"].to_numpy(str))
    return judged_of(SampleTruth.of(truth), seed, scores_N_4, named_N)


def judged_of(tested: SampleTruth, seed: int, scores_N_4: np.ndarray, named_N: np.ndarray) -> Judged:
    """Return test samples with scores of :data:`gpca.causes.dataset.LABELS` and the labels named, empty for none."""
    return _judged(tested, seed, 1 - scores_N_4[:, 0], scores_N_4, named_N)


def ceiling_of(causes: Causes | SampleTruth, seed: int) -> Judged:
    """Return test samples with the truth measured from other starts as their predictions."""
    tested = SampleTruth.of(causes) if isinstance(causes, Causes) else causes
    again = tested.truth_again
    error_N = again.error[:, -1]
    shares_N_3 = np.maximum(again.phi, 0) + 1e-12
    shares_N_3 = shares_N_3 / shares_N_3.sum(axis=1, keepdims=True)
    # A sample that lies between the limits this time is named by the nearer one.
    is_nominal_N = error_N < (again.nominal_limit + again.failed_limit) / 2
    scores_N_4 = np.column_stack([is_nominal_N.astype(float), ~is_nominal_N[:, None] * shares_N_3])
    named_N = np.where(is_nominal_N, NOMINAL, np.array(CONCEPTS)[again.phi.argmax(axis=1)])
    return _judged(tested, seed, error_N, scores_N_4, named_N)


def _judged(tested: SampleTruth, seed: int, alarm_N, scores_N_4: np.ndarray, named_N: np.ndarray) -> Judged:
    truth = tested.truth
    return Judged(
        label=labels_of(truth),
        instance=tested.cluster,
        seed=np.full(len(truth), seed),
        error=truth.error,
        phi=truth.phi,
        causes=truth.causes,
        tied=truth.tied,
        margin=truth.margin,
        shown=state_of_errors(tested.error_shown, truth),
        symmetric=tested.symmetric,
        alarm=np.asarray(alarm_N, float),
        scores=scores_N_4[:, 1:],
        named=named_N,
        nominal=scores_N_4[:, 0],
    )
