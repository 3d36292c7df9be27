"""Saliency maps of point clouds, tested by deleting the most salient points.

A saliency map is the gradient of a score in the input (Simonyan et al. 2014), here of GP-CA's log odds of a concept in
the points that the encoder sees. For clouds Zheng et al. (2019) take deleting a point for moving it to the center:
saliency is then r² ∂/∂r of the score, with r the distance from the center.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import torch

from gpca.classifier.gpc import GPC
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import draw_points
from gpca.experiments.gradients.settings import GradientSettings
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.portable import log_sum_exp
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

GRADIENT, CENTER, LEAST, RANDOM = "gradient", "to_centre", "least_gradient", "random"
ORDERS = (GRADIENT, CENTER, LEAST, RANDOM)  # in which points are deleted
RANDOM_ORDERS = 4  # whose mean counts


def chosen_rows(registrations: Registrations, count: int) -> np.ndarray:
    """Return the rows of the first test samples of each concept, `count` in all or as many as there are."""
    test = registrations.rows("test")
    of_concept = [test[registrations.concept[test] == concept][: count // len(CONCEPTS)] for concept in CONCEPTS]
    return np.sort(np.concatenate(of_concept))


def drawn_cloud(registrations: Registrations, row: int, source: str, seed: int, settings: EncoderSettings):
    """Return a draw (1, N, 3) of a row's aligned cloud, as the encoder sees it."""
    return draw_points(registrations, np.array([row]), settings.draw_points, source, seed, "saliency")


def log_odds(logits_N_C: torch.Tensor, of: int) -> torch.Tensor:
    """Return the log odds (N,) of one class against all others, from logits."""
    others = [c for c in range(logits_N_C.shape[1]) if c != of]
    return logits_N_C[:, of] - log_sum_exp(logits_N_C[:, others])


def point_gradient(encoder: torch.nn.Module, gpc: GPC, cloud_1_N_3: torch.Tensor, of: int) -> np.ndarray:
    """Return the gradient (N, 3) of a class's log odds in the points, per diameter."""
    points = cloud_1_N_3.clone().requires_grad_()
    (gradient_1_N_3,) = torch.autograd.grad(log_odds(gpc.mean_logits(encoder(points)), of).sum(), points)
    return gradient_1_N_3[0].numpy().astype(float)


def saliencies(points_N_3: np.ndarray, gradient_N_3: np.ndarray) -> dict[str, np.ndarray]:
    """Return the saliency (N,) of each point: length of its gradient, and what moving it to the center costs.

    The center is the median of the points.
    """
    outwards_N_3 = points_N_3 - np.median(points_N_3, axis=0)
    radius_N = np.linalg.norm(outwards_N_3, axis=1)
    falling_N = np.sum(gradient_N_3 * outwards_N_3, axis=1) * radius_N  # r² ∂/∂r, as ∂/∂r is along the unit vector
    return {GRADIENT: np.linalg.norm(gradient_N_3, axis=1), CENTER: falling_N}


def orders(salient: Mapping[str, np.ndarray], *axes: object) -> dict[str, list[np.ndarray]]:
    """Return the orders (N,) in which points are deleted, by name; several of the random one."""
    by_length = np.argsort(-salient[GRADIENT], kind="stable")
    n = len(by_length)
    return {
        GRADIENT: [by_length],
        CENTER: [np.argsort(-salient[CENTER], kind="stable")],
        LEAST: [by_length[::-1]],
        RANDOM: [generator(*axes, "deleted", again).permutation(n) for again in range(RANDOM_ORDERS)],
    }


def deletions(
    encoder: torch.nn.Module,
    gpc: GPC,
    registrations: Registrations,
    source: str,
    seed: int,
    encoding: EncoderSettings,
    settings: GradientSettings,
) -> tuple[pd.DataFrame, dict[str, np.ndarray]]:
    """Delete points of test samples in every order, and explain what is left with GP-CA.

    The scores are those of the concept that GP-CA names on the whole draw.

    Returns:
        a row for each sample, order and share: ``sample, concept, named, order, deleted, before, after, changed``, the
        scores and the share of orders after which another concept is named; and by name the arrays of the samples:
        ``sample`` (S), ``points`` (S, N, 3), ``saliency`` (S, N).
    """
    import pandas as pd

    records: list[tuple] = []
    arrays: dict[str, list] = {"sample": [], "points": [], "saliency": []}
    for row in chosen_rows(registrations, settings.samples):
        sample = int(registrations.sample[row])
        cloud_1_N_3 = drawn_cloud(registrations, row, source, seed, encoding)
        points_N_3 = cloud_1_N_3[0].numpy().astype(float)
        (before_C,) = _scores(encoder, gpc, cloud_1_N_3)
        named = int(before_C.argmax())
        salient = saliencies(points_N_3, point_gradient(encoder, gpc, cloud_1_N_3, named))
        for name, value in (("sample", sample), ("points", points_N_3), ("saliency", salient[GRADIENT])):
            arrays[name].append(value)
        ways = orders(salient, source, seed, sample)
        for share in settings.deleted:
            kept = max(1, round((1 - share) * len(points_N_3)))
            rows_W_K = np.array([np.sort(way[len(way) - kept :]) for of_order in ways.values() for way in of_order])
            after_W_C = _scores(encoder, gpc, cloud_1_N_3[0][torch.from_numpy(rows_W_K)])
            for order, of_order in ways.items():
                after_R_C, after_W_C = np.split(after_W_C, [len(of_order)])
                changed = np.mean(after_R_C.argmax(axis=1) != named)
                scores = (before_C[named], after_R_C[:, named].mean(), changed)
                records.append((sample, registrations.concept[row], gpc.classes[named], order, share, *scores))
    columns = ["sample", "concept", "named", "order", "deleted", "before", "after", "changed"]
    shown = {name: np.array(values, np.float32 if name != "sample" else int) for name, values in arrays.items()}
    return pd.DataFrame(records, columns=columns), shown


@torch.no_grad()
def _scores(encoder: torch.nn.Module, gpc: GPC, clouds_B_N_3: torch.Tensor) -> np.ndarray:
    return gpc.attribute(encoder(clouds_B_N_3).numpy())[0]
