"""A trained encoder as arrays: DGCNN's embedding without torch, by the same code for a run and for ``gpca explain``.

:mod:`gpca.encoders.dgcnn` explains how EdgeConv is evaluated per point. Other backbones are evaluated by torch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from gpca.encoders import edge_kernels
from gpca.encoders.registry import DGCNNOptions, EncoderSettings, make_encoder
from gpca.errors import InputError

if TYPE_CHECKING:
    from torch import nn

NEGATIVE_SLOPE = 0.2
EPSILON = 1e-5  # added to variances by batch norm, of these parts
NORM = ("weight", "bias", "running_mean", "running_var")
WIDTHS = (64, 64, 128, 256)  # of the EdgeConvs
CHANNELS = 32  # that torch adds at once
BLOCK = 16  # rows whose sum is made before it is added to others, as torch does for at most 2¹⁹ rows


@dataclass(frozen=True)
class TrainedEncoder:
    """A backbone with its options and trained weights."""

    settings: EncoderSettings  # number of points per draw and of draws per embedding, among others
    weights: Mapping[str, np.ndarray]  # the state of the backbone

    @classmethod
    def of(cls, module: nn.Module, settings: EncoderSettings) -> TrainedEncoder:
        return cls(settings, {name: part.detach().cpu().numpy() for name, part in module.state_dict().items()})

    def __call__(self, clouds_B_N_3: np.ndarray, device: str | None = None) -> np.ndarray:
        """Return embeddings (B, d) of clouds in the target's frame and in diameters, on a device of torch."""
        if self.settings.backbone == "dgcnn" and device in (None, "cpu"):
            return embed_clouds(self.weights, DGCNNOptions(**self.settings.options).k, clouds_B_N_3.astype(np.float32))
        import torch

        module = self.module.to(device or "cpu")
        with torch.inference_mode():
            return module(torch.from_numpy(clouds_B_N_3.astype(np.float32)).to(device)).cpu().numpy()

    @cached_property
    def module(self) -> nn.Module:
        import torch

        module = make_encoder(self.settings.backbone, self.settings.options)
        module.load_state_dict({name: torch.from_numpy(array) for name, array in self.weights.items()})
        return module.eval()

    def require_weights(self) -> int:
        """Raise a ValueError unless the weights are those of the backbone, and return the size of its embeddings."""
        if self.settings.backbone == "dgcnn":
            options = DGCNNOptions(**self.settings.options)
            shapes, size = expected_shapes(options.point_features), options.embedding_size
        else:
            import torch

            with torch.device("meta"):  # the options may ask for more than the memory
                module = make_encoder(self.settings.backbone, self.settings.options)
            shapes = {name: tuple(part.shape) for name, part in module.state_dict().items()}
            size = module.embedding_size
        if not isinstance(self.weights, Mapping) or set(self.weights) != set(shapes):
            raise ValueError("its encoder has different parts")
        for name, shape in shapes.items():
            value, dtype = self.weights[name], np.int64 if name.endswith("num_batches_tracked") else np.float32
            if not isinstance(value, np.ndarray) or value.shape != tuple(shape) or value.dtype != dtype:
                raise ValueError(f"'{name}' of its encoder has a different shape or type")
            if name.endswith("running_var") and (value < 0).any():
                raise ValueError(f"'{name}' of its encoder contains negative variances")
        return size


def embed_clouds(
    weights: Mapping[str, np.ndarray], k: int, x_B_N_F: np.ndarray, sizes: Sequence[int] | None = None
) -> np.ndarray:
    """Return DGCNN's embeddings (B, d) of clouds by its state, with the bits of torch's layers.

    With `sizes`, `x_B_N_F` holds clouds of these sizes one after another, and B is 1.
    """
    features = []
    for layer in range(sum(name.startswith("edge_convs.") and name.endswith(".norm.weight") for name in weights)):
        neighbors_B_N_k = nearest(x_B_N_F, k, sizes)
        w1, w2 = np.split(weights[f"edge_convs.{layer}.weight"], 2, axis=1)
        ac_B_N_2F = product(x_B_N_F.reshape(-1, x_B_N_F.shape[2]), np.concatenate([w1, w2 - w1]).T)
        ac_B_N_2F = ac_B_N_2F.reshape(*x_B_N_F.shape[:2], -1)
        affine = scale_and_shift(*_norm(weights, f"edge_convs.{layer}.norm"))
        x_B_N_F = edge_kernels.gather_max_affine(ac_B_N_2F, neighbors_B_N_k, *affine, NEGATIVE_SLOPE)
        features.append(x_B_N_F)
    joined_P_F = np.concatenate(features, axis=-1).reshape(-1, sum(part.shape[2] for part in features))
    y_P_F = _normalized(product(joined_P_F, weights["point_layer.weight"].T), weights, "point_norm")
    y_B_N_F = np.where(y_P_F > 0, y_P_F, y_P_F * np.float32(NEGATIVE_SLOPE)).reshape(*x_B_N_F.shape[:2], -1)
    parts = [y_B_N_F] if sizes is None else np.split(y_B_N_F, np.cumsum(sizes[:-1]), axis=1)
    return np.concatenate([np.concatenate([part.max(axis=1), _mean(part)], axis=-1) for part in parts])


def nearest(x_B_N_F: np.ndarray, k: int, sizes: Sequence[int] | None = None) -> np.ndarray:
    """Return the indices (B, N, k), in any order, of each point's k nearest points in feature space, itself included.

    With `sizes`, B is 1 and the points are concatenated clouds, each searched within its own points.
    """
    if sizes is not None:
        starts = np.cumsum([0, *sizes], dtype=np.int32)
        return np.concatenate([nearest(x_B_N_F[:, a:b], k) + a for a, b in pairwise(starts)], axis=1)
    if (n_points := x_B_N_F.shape[1]) < k:
        fault = f"has fewer than {k} neighbors per point"
        raise InputError(f"cloud of {n_points} points", fault, "raise draw_points or lower k")
    # |x_j|² - 2 x_i·x_j, as one product of [x_i ; 1] and [-2 x_j ; |x_j|²]: |x_i|² is the same for a whole row and does
    # not change which points are nearest.
    rows_B_N_G = np.concatenate([x_B_N_F, np.ones_like(x_B_N_F[..., :1])], axis=-1)
    columns_B_N_G = np.concatenate([-2 * x_B_N_F, _squares(x_B_N_F)[..., None]], axis=-1)
    return edge_kernels.smallest_k(product(rows_B_N_G, np.swapaxes(columns_B_N_G, 1, 2)), k)


def expected_shapes(point_features: int) -> dict[str, tuple]:
    """Return the shape of every array in the state of a DGCNN."""
    shapes: dict[str, tuple] = {}
    for layer, (before, after) in enumerate(pairwise((3, *WIDTHS))):
        shapes[f"edge_convs.{layer}.weight"] = (after, 2 * before)
        shapes |= _norm_shapes(f"edge_convs.{layer}.norm", after)
    return shapes | {"point_layer.weight": (point_features, sum(WIDTHS))} | _norm_shapes("point_norm", point_features)


def _norm_shapes(name: str, features: int) -> dict[str, tuple]:
    return {f"{name}.{part}": (features,) for part in NORM} | {f"{name}.num_batches_tracked": ()}


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    with np.errstate(over="ignore", invalid="ignore"):  # as torch; a diverging training is stopped by its loss
        return np.matmul(a, b)


def scale_and_shift(
    weight_F: np.ndarray, bias_F: np.ndarray, mean_F: np.ndarray, variance_F: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return scale and shift (F,) of a batch norm in inference: the output is ``scale * y + shift``."""
    scale_F = weight_F * (np.float32(1) / np.sqrt(variance_F + np.float32(EPSILON)))
    return scale_F, bias_F - scale_F * mean_F


def _norm(weights: Mapping[str, np.ndarray], name: str) -> list[np.ndarray]:
    return [weights[f"{name}.{part}"] for part in NORM]


def _normalized(x_P_F: np.ndarray, weights: Mapping[str, np.ndarray], norm: str) -> np.ndarray:
    """Return the batch norm of x; products are added before they are rounded, as torch's layer does."""
    parts = _norm(weights, norm)
    scale_F, (_, bias_F, mean_F, _) = scale_and_shift(*parts)[0], (part.astype(np.float64) for part in parts)
    shift_F = (bias_F - mean_F * scale_F).astype(np.float32)
    return (x_P_F.astype(np.float64) * scale_F + shift_F).astype(np.float32)


def _squares(x_P_F: np.ndarray) -> np.ndarray:
    """Return |x|² (…), added in the order of torch's vectors of eight numbers, four at a time."""
    with np.errstate(over="ignore"):  # as in a product
        squares_P_F = x_P_F * x_P_F
    lanes = 8 if squares_P_F.shape[-1] >= 8 else 1
    count = squares_P_F.shape[-1] // lanes
    columns = [squares_P_F[..., lanes * i : lanes * (i + 1)] for i in range(count)]
    fourth = count // 4 * 4
    first = reduce(np.add, columns[0:fourth:4] + columns[fourth:])
    lanes_P_8 = reduce(np.add, [first, *(reduce(np.add, columns[i:fourth:4]) for i in (1, 2, 3) if fourth)])
    remaining = squares_P_F[..., count * lanes :]
    return reduce(np.add, [*np.moveaxis(remaining, -1, 0), *np.moveaxis(lanes_P_8, -1, 0)])


def _mean(x_B_N_F: np.ndarray) -> np.ndarray:
    """Return the mean over the points (B, F), added in torch's order: narrow channels every fourth point first."""
    rows, wide = np.moveaxis(x_B_N_F, 1, 0), x_B_N_F.shape[2] // CHANNELS * CHANNELS
    narrow, fourth = rows[..., wide:], len(rows) // 4 * 4
    first, *others = (_added(narrow[i:fourth:4]) for i in range(4))
    sums = [_added(rows[..., :wide]), reduce(np.add, [first, *narrow[fourth:], *others])]
    return np.concatenate(sums, axis=1) / np.float32(x_B_N_F.shape[1])


def _added(rows: np.ndarray) -> np.ndarray:
    """Return the sum of rows (N, …): sums of `BLOCK` rows are added to those of as many of them, and so on."""
    total = np.zeros(rows.shape[1:], rows.dtype)
    for level in range(4):
        blocked = len(rows) // BLOCK * BLOCK if level < 3 else 0
        total = total + rows[blocked:].sum(axis=0)
        rows = rows[:blocked].reshape(blocked // BLOCK, BLOCK, *rows.shape[1:]).sum(axis=1)
    return total
