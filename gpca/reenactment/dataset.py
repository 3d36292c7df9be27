"""Re-enactments of registrations, and the file that holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from gpca.alignment.pose_error import displacements
from gpca.alignment.rigid import transform
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.descriptors import WIDTHS, describe_plainly, observed_pair
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import SUBSETS
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import ObservedPair
from gpca.process.progress import progress
from gpca.reenactment.enactment import Enactment, reenact
from gpca.reenactment.hypotheses import weights_of
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.verdict import verdict

MEASURED = ("log_likelihood", "width", "covered", "noise", "outliers", "missing", "to_start", "to_result")
DESCRIBED = ("distances", "planes", "motion", "starts")  # groups of descriptors, without further registrations


@dataclass(frozen=True)
class Reenactments(Container):
    """The re-enactments of S registrations under K hypotheses each, the most probable first.

    Where a pair has fewer hypotheses, its first stands in the place of the others, with weight 0.

    Attributes:
        sample, split: (S,) as in the registrations.
        weight: (S, K) probabilities of the hypotheses.
        T_model_observed: (S, K, 4, 4) takes what was observed from where the registration began to where a hypothesis
            has it in the model, in diameters.
        error, uncertainty: (S, K, 8) v̂ and û of every subset of the causes.
        measured: (S, K, 8) the numbers of `MEASURED`: those of :class:`gpca.reenactment.hypotheses.Hypothesis`; the
            severities of noise, outliers and crop under it; and how far (root mean square, diameters) the observed
            points then lie from where the registration began, and from where it ended.
        described: (S, F) the groups `DESCRIBED` of descriptors (:mod:`gpca.causes.descriptors`), side by side.
        verdict: (S, 4) of :func:`gpca.reenactment.verdict.verdict`.
    """

    sample: np.ndarray = array("S", WHOLE)
    split: np.ndarray = array("S", TEXT)
    weight: np.ndarray = array("S K")
    T_model_observed: np.ndarray = array("S K 4 4")
    error: np.ndarray = array(f"S K {len(SUBSETS)}")
    uncertainty: np.ndarray = array(f"S K {len(SUBSETS)}")
    measured: np.ndarray = array(f"S K {len(MEASURED)}")
    described: np.ndarray = array(f"S {sum(WIDTHS[group] for group in DESCRIBED)}")
    verdict: np.ndarray = array(f"S {len(LABELS)}")

    @classmethod
    def of_rows(
        cls, rows: Sequence[Mapping[str, np.ndarray]], truth: CauseSettings, registrations: Registrations | None = None
    ) -> Reenactments:
        """Return those of the rows of pairs (:func:`row_of`), which may be of no registrations of a file."""
        arrays = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        return cls(
            sample=np.arange(len(rows)) if registrations is None else registrations.sample,
            split=np.full(len(rows), "") if registrations is None else registrations.split,
            **arrays,
            verdict=verdict(arrays["error"], arrays["weight"], truth.limits),
            axes=None if registrations is None else registrations.axes,
        )


def reenact_all(
    causes: Causes, source: str, seed: int, settings: ReenactmentSettings, truth: CauseSettings
) -> tuple[Reenactments, np.ndarray, np.ndarray]:
    """Return the re-enactments of every row, the seconds (S,) that each took, and those of its registrations.

    Args:
        truth: how counterfactuals are registered, and the limits of the states.
    """
    rows, seconds, icp_seconds = [], [], []
    for row in progress(range(len(causes)), f"re-enactments of {source}, seed {seed}"):
        started = perf_counter()
        pair = observed_pair(causes, row, source, seed, "reenactment")
        enactments = reenact(pair, settings, truth)
        rows.append(row_of(enactments, pair, settings, truth))
        seconds.append(perf_counter() - started)
        icp_seconds.append(sum(enactment.icp_seconds for enactment in enactments))
    return Reenactments.of_rows(rows, truth, causes.registrations), np.array(seconds), np.array(icp_seconds)


def row_of(
    enactments: list[Enactment], pair: ObservedPair, settings: ReenactmentSettings, truth: CauseSettings
) -> dict[str, np.ndarray]:
    """Return the arrays of one pair, see :class:`Reenactments`."""
    described = np.concatenate([*describe_plainly(pair, truth.icp).values()])
    return as_arrays(enactments, pair, settings.hypotheses) | {"described": described}


def as_arrays(enactments: list[Enactment], pair: ObservedPair, most: int) -> dict[str, np.ndarray]:
    """Return the arrays of one pair (K, …), see :class:`Reenactments`, for K = `most` hypotheses."""
    rows_K = np.where(np.arange(most) < len(enactments), np.arange(most), 0)
    measured_k = [_measured(enactment, pair) for enactment in enactments]
    return {
        "weight": np.pad(weights_of(enactment.hypothesis for enactment in enactments), (0, most - len(enactments))),
        "T_model_observed": np.array([enactment.hypothesis.T for enactment in enactments])[rows_K],
        "error": np.array([enactment.error_8 for enactment in enactments])[rows_K],
        "uncertainty": np.array([enactment.uncertainty_8 for enactment in enactments])[rows_K],
        "measured": np.array(measured_k)[rows_K],
    }


def _measured(enactment: Enactment, pair: ObservedPair) -> list[float]:
    hypothesis, severity = enactment.hypothesis, enactment.candidate.severity
    before = transform(pair.T_init, pair.observed)
    return [
        *(hypothesis.log_likelihood, hypothesis.width, hypothesis.covered),
        *(severity["noise"], severity["outliers"], severity["crop"]),
        displacements(hypothesis.T[None], before)[0],
        displacements((hypothesis.T @ pair.T_init)[None], pair.observed)[0],
    ]
