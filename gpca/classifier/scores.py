"""An explainer's attribution of registrations: a score and a variance per concept, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import require_numbers


@dataclass(frozen=True)
class Attribution:
    """The attribution of N registrations to C concepts; variances and BALD are NaN where an explainer has none."""

    concepts: tuple[str, ...]
    scores_N_C: np.ndarray  # score ŝ_c of each concept (Eq. 4)
    variances_N_C: np.ndarray  # epistemic variance v_c (Eq. 5)
    bald_N: np.ndarray  # nats (Eq. 7)
    abstained_N: np.ndarray  # whether the explainer declines to name a concept
    icp_calls_N: np.ndarray  # ICP runs beyond the observed registration
    seconds_N: np.ndarray  # time of the explanation
    icp_seconds_N: np.ndarray  # the part of it inside ICP

    def __post_init__(self) -> None:
        """Refuse what code from outside cannot have meant."""
        if not all(isinstance(each, str) for each in self.concepts) or len(set(self.concepts)) < len(self.concepts):
            raise InputError("concepts", f"are {self.concepts!r}", "give different names")
        shape = len(require_numbers(self.scores_N_C, (None, len(self.concepts)), "scores_N_C")), len(self.concepts)
        require_numbers(self.variances_N_C, shape, "variances_N_C", finite=False)
        require_numbers(self.bald_N, shape[:1], "bald_N", finite=False)
        require_numbers(self.abstained_N, shape[:1], "abstained_N", kinds="b")
        for name in ("icp_calls_N", "seconds_N", "icp_seconds_N"):
            require_numbers(getattr(self, name), shape[:1], name)

    @classmethod
    def of_scores(
        cls,
        concepts: tuple[str, ...],
        scores_N_C: np.ndarray,
        *,
        seconds: np.ndarray | float = 0.0,
        icp_seconds: np.ndarray | float = 0.0,
        icp_calls: np.ndarray | int = 0,
        abstained_N: np.ndarray | None = None,
        variances_N_C: np.ndarray | None = None,
        bald_N: np.ndarray | None = None,
    ) -> Attribution:
        """Make the attribution of an explainer; times and calls are one number for each row, or one for all."""
        n = len(require_numbers(scores_N_C, (None, len(concepts)), "scores_N_C"))
        seconds, icp_seconds, icp_calls = (
            require_numbers(np.broadcast_to(each, n), (n,), "seconds or calls")
            for each in (seconds, icp_seconds, icp_calls)
        )
        return cls(
            concepts=concepts,
            scores_N_C=scores_N_C,
            variances_N_C=np.full(scores_N_C.shape, np.nan) if variances_N_C is None else variances_N_C,
            bald_N=np.full(n, np.nan) if bald_N is None else bald_N,
            abstained_N=np.zeros(n, bool) if abstained_N is None else abstained_N,
            icp_calls_N=icp_calls.astype(int),
            seconds_N=seconds.astype(float),
            icp_seconds_N=icp_seconds.astype(float),
        )

    def in_order(self, concepts: tuple[str, ...]) -> Attribution:
        """Return it with its columns in another order."""
        columns = [self.concepts.index(concept) for concept in concepts]
        scores_N_C, variances_N_C = self.scores_N_C[:, columns], self.variances_N_C[:, columns]
        return replace(self, concepts=concepts, scores_N_C=scores_N_C, variances_N_C=variances_N_C)

    @property
    def predicted_N(self) -> np.ndarray:
        """The concept with the largest score (Eq. 6), the first of equals; empty if it abstained."""
        return np.where(self.abstained_N, "", np.array(self.concepts)[self.scores_N_C.argmax(axis=1)])

    @property
    def entropy_N(self) -> np.ndarray:
        """Predictive entropy in nats of the scores, normalized to sum to one; negative ones have no share."""
        positive_N_C = np.maximum(self.scores_N_C, 0)
        positive_N_C = np.where(positive_N_C.sum(axis=1, keepdims=True) > 0, positive_N_C, 1.0)
        return entropy(positive_N_C / positive_N_C.sum(axis=1, keepdims=True))


def entropy(p: np.ndarray) -> np.ndarray:
    """Return H[p] in nats over the last axis; 0 log 0 = 0."""
    return -np.sum(p * np.log(np.where(p > 0, p, 1.0)), axis=-1)


def summarize_draws(logits_M_N_C: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return scores (N, C), variances (N, C) and BALD (N,) of M posterior draws of the latent logits (Eqs. 2, 4, 5, 7).

    With p = softmax(f), ŝ = mean of p over the draws, v = mean of (p - ŝ)², BALD = H[ŝ] - mean of H[p].
    """
    return _summarize(np.array(logits_M_N_C.T, order="C", dtype=float))


def summarize_marginals(
    mean_N_C: np.ndarray, deviation_N_C: np.ndarray, normal_M_C: np.ndarray, block: int = 16
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Summarize draws mean + deviation · normal, the same for all points, as :func:`summarize_draws` does."""
    normal_C_1_M, parts = np.ascontiguousarray(normal_M_C.T)[:, None], []
    for start in range(0, max(len(mean_N_C), 1), block):
        rows = slice(start, start + block)
        logits_C_N_M = normal_C_1_M * deviation_N_C[rows].T[:, :, None]
        logits_C_N_M += mean_N_C[rows].T[:, :, None]
        parts.append(_summarize(logits_C_N_M))
    scores_N_C, variances_N_C, bald_N = (np.concatenate(part) for part in zip(*parts, strict=True))
    return scores_N_C, variances_N_C, bald_N


def _summarize(logits_C_N_M: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    # In the given array, as new ones would take most of the time. Classes come first, as sums over three neighbors are
    # slow, and draws last, so that a point's sums do not depend on how many others there are.
    logits_C_N_M -= logits_C_N_M.max(axis=0)
    p_C_N_M = np.exp(logits_C_N_M)
    total_N_M = p_C_N_M.sum(axis=0)
    p_C_N_M /= total_N_M
    scores_C_N = p_C_N_M.mean(axis=2)
    # H[softmax(f)] = log Σ exp f - Σ p f: one logarithm per draw instead of one per class.
    logits_C_N_M *= p_C_N_M
    entropy_N = np.log(total_N_M, out=total_N_M).mean(axis=1) - logits_C_N_M.sum(axis=0).mean(axis=1)
    p_C_N_M -= scores_C_N[:, :, None]
    variances_C_N = np.square(p_C_N_M, out=p_C_N_M).mean(axis=2)
    return scores_C_N.T, variances_C_N.T, entropy(scores_C_N.T) - entropy_N
