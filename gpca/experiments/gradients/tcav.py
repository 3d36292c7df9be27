"""TCAV (Kim et al. 2018): how often moving along a concept raises a class's score, and whether chance would do so too.

A concept activation vector (CAV) is the normal of a linear probe that tells examples of a concept from random samples,
in the embedding that GP-CA reads. TCAV's score of a concept for a class is the share of the class's test samples whose
log odds of that class grow along the vector. Vectors of random samples against random ones say what chance gives: a
score counts where a two-sided t-test of both, over as many vectors each and with Bonferroni's correction, tells them
apart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import torch

from gpca.classifier.gpc import GPC
from gpca.experiments.gradients.saliency import log_odds
from gpca.experiments.gradients.settings import GradientSettings
from gpca.pairs.dataset import Registrations
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

ONE_OBJECT = "one object"  # a concept that should not matter: samples of the object that is seen most often
FEWEST = 4  # examples of a concept


def concept_examples(train: Registrations, concepts: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Return whether each training sample (N,) shows a concept: each perturbation, and one object among all."""
    examples = {concept: train.concept == concept for concept in concepts}
    names, counts = np.unique(train.object_name, return_counts=True)
    if len(names) > 1:
        examples[ONE_OBJECT] = train.object_name == names[counts.argmax()]
    return {name: shown_N for name, shown_N in examples.items() if shown_N.sum() >= FEWEST}


def tcav(
    gpc: GPC, train: Registrations, test: Registrations, settings: GradientSettings, *axes: object
) -> pd.DataFrame:
    """Return the scores of every concept for every class.

    Args:
        gpc: has learned from the training samples.
        train, test: with their embeddings.
        axes: name the random numbers.

    Returns:
        a row for each concept and class: ``tested, concept`` (the class), ``score``, ``chance`` (means over the
        vectors), ``p`` of the test, ``significant`` (0 or 1), ``probe`` (accuracy of the concept's probes on the
        samples that they did not learn, balanced).
    """
    import pandas as pd

    h_N_d = train.embedding.astype(float)
    mean_d, deviation_d = h_N_d.mean(axis=0), np.maximum(h_N_d.std(axis=0), 1e-9)
    scaled_N_d = (h_N_d - mean_d) / deviation_d
    gradients = {c: _gradients(gpc, test, c) * deviation_d for c in gpc.classes if (test.concept == c).any()}
    examples = concept_examples(train, gpc.classes)
    rows = []
    for tested, shown_N in examples.items():
        size = max(2, min(int(shown_N.sum()), int((~shown_N).sum())) // 2)
        probes = [_vector(scaled_N_d, shown_N, size, *axes, tested, v) for v in range(settings.vectors)]
        drawn = [_vector(scaled_N_d, None, size, *axes, tested, v) for v in range(settings.vectors)]
        for concept, gradient_N_d in gradients.items():
            score_V, chance_V = ([_score(gradient_N_d, vector_d) for vector_d, _ in of] for of in (probes, drawn))
            p = two_sided_p(score_V, chance_V)
            rows.append(
                {
                    "tested": tested,
                    "concept": concept,
                    "score": np.mean(score_V),
                    "chance": np.mean(chance_V),
                    "p": p,
                    "significant": int(p < settings.level / (len(examples) * len(gradients))),
                    "probe": np.mean([accuracy for _, accuracy in probes]),
                }
            )
    return pd.DataFrame(rows)


def two_sided_p(score_V: list[float], chance_V: list[float]) -> float:
    """Return the probability of a difference of means as large by chance (Welch); 0 or 1 where neither varies."""
    from scipy.stats import t as student_t

    difference = abs(np.mean(score_V) - np.mean(chance_V))
    errors_2 = np.array([np.var(values_V, ddof=1) / len(values_V) for values_V in (score_V, chance_V)])
    if not errors_2.any():
        return float(difference == 0)
    freedom = errors_2.sum() ** 2 / np.sum(errors_2**2 / (np.array([len(score_V), len(chance_V)]) - 1))
    return float(2 * student_t.sf(difference / np.sqrt(errors_2.sum()), freedom))


def _gradients(gpc: GPC, test: Registrations, concept: str) -> np.ndarray:
    """Return the gradient (N, d) of a class's log odds in the embeddings of its own test samples."""
    h_N_d = torch.from_numpy(test.embedding[test.concept == concept].astype(float)).requires_grad_()
    odds_N = log_odds(gpc.mean_logits(h_N_d), gpc.classes.index(concept))
    return torch.autograd.grad(odds_N.sum(), h_N_d)[0].numpy()


def _score(gradient_N_d: np.ndarray, vector_d: np.ndarray) -> float:
    return float(np.mean(gradient_N_d @ vector_d > 0))


def _vector(scaled_N_d: np.ndarray, shown_N: np.ndarray | None, size: int, *axes: object) -> tuple[np.ndarray, float]:
    """Return a unit vector (d,) towards a concept, or between random samples, and its probe's balanced accuracy.

    The probe learns `size` examples and as many samples that do not show the concept; of random samples, any.
    """
    from sklearn.linear_model import LogisticRegression

    random = generator(*axes, "random vector" if shown_N is None else "concept vector")
    order_N = random.permutation(len(scaled_N_d))
    if shown_N is None:
        shown_N = np.isin(np.arange(len(order_N)), order_N[: len(order_N) // 2])
        order_N = random.permutation(len(order_N))
    parts = [order_N[shown_N[order_N]], order_N[~shown_N[order_N]]]
    learned = np.concatenate([part[:size] for part in parts])
    probe = LogisticRegression(max_iter=1000).fit(scaled_N_d[learned], shown_N[learned])
    others = [part[size:] for part in parts if len(part) > size]
    accuracy = np.mean([np.mean(probe.predict(scaled_N_d[part]) == shown_N[part]) for part in others]) if others else 1
    return probe.coef_[0] / max(float(np.linalg.norm(probe.coef_[0])), 1e-12), float(accuracy)
