"""What an explainer says of registrations: a score and a variance per concept, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.dataset import Registrations
from gpca.errors import InputError
from gpca.files import whole_file


@dataclass(frozen=True)
class Attribution:
    """The attribution of N registrations to C concepts, rows in the order of the registrations.

    Attributes:
        concepts: (C,) names, in the order of the columns.
        scores_N_C: score ŝ_c of each concept (Eq. 4).
        variances_N_C: epistemic variance v_c (Eq. 5); NaN where an explainer has none.
        bald_N: BALD in nats (Eq. 7); NaN where an explainer has none.
        abstained_N: the explainer declines to name a concept.
        icp_calls_N: ICP runs beyond the observed registration.
        seconds_N, icp_seconds_N: time of the explanation, and the part of it inside ICP.
    """

    concepts: tuple[str, ...]
    scores_N_C: np.ndarray
    variances_N_C: np.ndarray
    bald_N: np.ndarray
    abstained_N: np.ndarray
    icp_calls_N: np.ndarray
    seconds_N: np.ndarray
    icp_seconds_N: np.ndarray

    @property
    def predicted_N(self) -> np.ndarray:
        """The concept with the largest score (Eq. 6), the first of equals; empty where abstained."""
        predicted = np.array(self.concepts)[self.scores_N_C.argmax(axis=1)]
        return np.where(self.abstained_N, "", predicted)

    @property
    def entropy_N(self) -> np.ndarray:
        """Predictive entropy H[ŝ] in nats of the scores, normalised to sum to one."""
        return entropy(self.scores_N_C / self.scores_N_C.sum(axis=1, keepdims=True))


def entropy(p: np.ndarray) -> np.ndarray:
    """Return H[p] in nats over the last axis; 0 log 0 = 0."""
    return -np.sum(p * np.log(np.where(p > 0, p, 1.0)), axis=-1)


def summarise_draws(logits_M_N_C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Turn M posterior draws of the latent logits into scores, variances and BALD.

    Eqs. 2, 4, 5 and 7 of the paper: p^(m) = softmax(f^(m)), ŝ = mean over m, v = mean squared deviation over m,
    BALD = H[ŝ] - mean over m of H[p^(m)].

    Returns:
        scores_N_C, variances_N_C, bald_N.
    """
    p_M_N_C = np.exp(logits_M_N_C - logits_M_N_C.max(axis=-1, keepdims=True))
    p_M_N_C /= p_M_N_C.sum(axis=-1, keepdims=True)
    scores_N_C = p_M_N_C.mean(axis=0)
    variances_N_C = np.square(p_M_N_C - scores_N_C).mean(axis=0)
    bald_N = entropy(scores_N_C) - entropy(p_M_N_C).mean(axis=0)
    return scores_N_C, variances_N_C, bald_N


def write_predictions(path: str | Path, registrations: Registrations, attribution: Attribution) -> None:
    """Write the prediction file that every table is made from (results/README.md); six decimals."""
    import pandas as pd

    frame = pd.DataFrame(
        {
            "sample": registrations.sample,
            "split": registrations.split,
            "object": registrations.object_name,
            "concept_true": registrations.concept,
            "concept_predicted": attribution.predicted_N,
            **{f"score_{c}": attribution.scores_N_C[:, i] for i, c in enumerate(attribution.concepts)},
            **{f"variance_{c}": attribution.variances_N_C[:, i] for i, c in enumerate(attribution.concepts)},
            "bald": attribution.bald_N,
            "entropy": attribution.entropy_N,
            "abstained": attribution.abstained_N,
            "icp_calls": attribution.icp_calls_N,
        }
    )
    _write_csv(path, frame)


def write_timings(
    path: str | Path, registrations: Registrations, seconds_S: np.ndarray, icp_seconds_S: np.ndarray
) -> None:
    """Write seconds per sample; apart from the predictions, because they differ from run to run."""
    import pandas as pd

    columns = {"sample": registrations.sample, "split": registrations.split}
    _write_csv(path, pd.DataFrame(columns | {"seconds": seconds_S, "icp_seconds": icp_seconds_S}))


def read_timings(path: str | Path, registrations: Registrations) -> tuple[np.ndarray, np.ndarray]:
    """Return seconds (S,) and icp_seconds (S,) of the registrations.

    Raises:
        InputError: the file is missing, lacks a column, or holds other samples.
    """
    import pandas as pd

    remedy = "make it anew with the step that writes it"
    if not Path(path).is_file():
        raise InputError(path, "no such file", remedy)
    try:
        frame = pd.read_csv(path)
    except ValueError as fault:  # an empty file, broken quotes, other bytes than text
        raise InputError(path, "is not a file of timings", remedy) from fault
    if not {"sample", "split", "seconds", "icp_seconds"} <= set(frame.columns):
        raise InputError(path, "is not a file of timings", remedy)
    if not all(np.array_equal(frame[name], getattr(registrations, name)) for name in ("sample", "split")):
        raise InputError(path, "does not hold the seconds of these samples", remedy)
    return frame["seconds"].to_numpy(), frame["icp_seconds"].to_numpy()


def _write_csv(path, frame) -> None:
    with whole_file(path) as partial:
        frame.to_csv(partial, index=False, float_format="%.6f", lineterminator="\n")
