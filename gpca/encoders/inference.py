"""A trained encoder as arrays: DGCNN's embedding without torch, by the same code for a run and for ``gpca explain``.

:mod:`gpca.encoders.dgcnn` explains how EdgeConv is evaluated per point. Other backbones are evaluated by torch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gpca.encoders import edge_kernels
from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.errors import InputError

if TYPE_CHECKING:
    from torch import nn

NEGATIVE_SLOPE = 0.2
EPSILON = 1e-5  # added to variances by batch norm
WIDTHS = (64, 64, 128, 256)  # of the EdgeConvs
BLOCK = 16  # rows whose sum is made before it is added to others, as torch does for at most 2¹⁹ rows


def embed_clouds(
    weights: Mapping[str, np.ndarray], k: int, x_B_N_F: np.ndarray, sizes: Sequence[int] | None = None
) -> np.ndarray:
    """Return DGCNN's embeddings (B, d) of clouds, with the bits of torch's layers.

    Args:
        weights: the state of :class:`gpca.encoders.dgcnn.DGCNN`.
        k: neighbors of a point, itself included.
        x_B_N_F: (B, N, F) float32. With `sizes`, it holds clouds of these sizes one after another, and B is 1.
    """
    features = []
    for layer in range(sum(name.startswith("edge_convs.") and name.endswith(".norm.weight") for name in weights)):
        neighbors_B_N_k = nearest(x_B_N_F, k, sizes)
        w1, w2 = np.split(weights[f"edge_convs.{layer}.weight"], 2, axis=1)
        ac_B_N_2F = _product(x_B_N_F.reshape(-1, x_B_N_F.shape[2]), np.concatenate([w1, w2 - w1]).T)
        ac_B_N_2F = ac_B_N_2F.reshape(*x_B_N_F.shape[:2], -1)
        scale_and_shift = _scale_and_shift(weights, f"edge_convs.{layer}.norm")
        x_B_N_F = edge_kernels.gather_max_affine(ac_B_N_2F, neighbors_B_N_k, *scale_and_shift, NEGATIVE_SLOPE)
        features.append(x_B_N_F)
    joined_P_F = np.concatenate(features, axis=-1).reshape(-1, sum(part.shape[2] for part in features))
    scale_F, shift_F = _scale_and_shift(weights, "point_norm")
    y_P_F = _product(joined_P_F, weights["point_layer.weight"].T) * scale_F + shift_F
    y_B_N_F = np.where(y_P_F > 0, y_P_F, y_P_F * np.float32(NEGATIVE_SLOPE)).reshape(*x_B_N_F.shape[:2], -1)
    parts = [y_B_N_F] if sizes is None else np.split(y_B_N_F, np.cumsum(sizes[:-1]), axis=1)
    return np.concatenate([np.concatenate([part.max(axis=1), _mean(part)], axis=-1) for part in parts])


def nearest(x_B_N_F: np.ndarray, k: int, sizes: Sequence[int] | None = None) -> np.ndarray:
    """Return the indices (B, N, k), in any order, of each point's k nearest points in feature space, itself included.

    With `sizes`, B is 1 and the points are concatenated clouds, each searched within its own points.
    """
    if sizes is not None:
        starts = np.cumsum([0, *sizes], dtype=np.int32)
        return np.concatenate([nearest(x_B_N_F[:, a:b], k) + a for a, b in zip(starts, starts[1:])], axis=1)
    if (n_points := x_B_N_F.shape[1]) < k:
        fault = f"has fewer than {k} neighbors per point"
        raise InputError(f"cloud of {n_points} points", fault, "raise draw_points or lower k")
    # |x_j|² - 2 x_i·x_j, as one product of [x_i ; 1] and [-2 x_j ; |x_j|²]: |x_i|² is the same for a whole row and does
    # not change which points are nearest.
    rows_B_N_G = np.concatenate([x_B_N_F, np.ones_like(x_B_N_F[..., :1])], axis=-1)
    columns_B_N_G = np.concatenate([-2 * x_B_N_F, _squares(x_B_N_F)[..., None]], axis=-1)
    return edge_kernels.smallest_k(_product(rows_B_N_G, np.swapaxes(columns_B_N_G, 1, 2)), k)
