"""Reductions of embeddings by name (paper, Table VI), fitted on the standardized training embeddings."""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Annotated

import numpy as np

from gpca.errors import InputError, require_known
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds, Count, require_arguments

Transform = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class PCA:
    """Principal component analysis (Jolliffe 2002), by a full singular value decomposition."""

    components: Count = 64

    def fit(self, z_train_N_d: np.ndarray, *axes: object) -> Transform:
        from sklearn.decomposition import PCA as SklearnPCA

        return SklearnPCA(self.components, svd_solver="full").fit(z_train_N_d).transform


@dataclass(frozen=True)
class UMAP:
    """Uniform manifold approximation and projection (McInnes et al. 2018) by umap-learn; more components add noise."""

    components: Count = 16
    neighbours: Annotated[int, Bounds(minimum=2)] = 15

    def fit(self, z_train_N_d: np.ndarray, *axes: object) -> Transform:
        """Return the transform of new samples; training samples pass it too, so that train and test agree."""
        seed = seed_of(*axes, "umap") % 2**32
        with warnings.catch_warnings(action="ignore"):
            random = {"random_state": seed, "transform_seed": seed, "n_jobs": 1}
            model = _umap_learn()(self.neighbours, self.components, **random).fit(z_train_N_d.astype(np.float32))

        def transform(z_S_d: np.ndarray) -> np.ndarray:
            # One by one: rows transformed together share random numbers and a threshold on their graph.
            with warnings.catch_warnings(action="ignore"):
                rows = [model.transform(z_1_d)[0] for z_1_d in z_S_d.astype(np.float32)[:, None]]
            return np.array(rows).reshape(len(z_S_d), self.components)

        return transform


@dataclass(frozen=True)
class Autoencoder:
    """Autoencoder (Hinton & Salakhutdinov 2006) d - 256 - components - 256 - d with GELU and a linear code."""

    components: Count = 64
    epochs: Count = 100

    def fit(self, z_train_N_d: np.ndarray, *axes: object) -> Transform:
        import torch
        from torch import nn

        from gpca.portable import Adam

        d, hidden, batch_size = z_train_N_d.shape[1], 256, 32
        z_N_d = torch.from_numpy(z_train_N_d.astype(np.float32))
        with _one_thread(torch), torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed_of(*axes, "autoencoder"))
            encoder = nn.Sequential(nn.Linear(d, hidden), nn.GELU(), nn.Linear(hidden, self.components))
            decoder = nn.Sequential(nn.Linear(self.components, hidden), nn.GELU(), nn.Linear(hidden, d))
            optimizer = Adam([*encoder.parameters(), *decoder.parameters()], 1e-3)
            for epoch in range(self.epochs):
                order = generator(*axes, "autoencoder", epoch).permutation(len(z_N_d))
                for rows in np.array_split(order, -(-len(order) // batch_size)):
                    z_B_d = z_N_d[rows]
                    loss = nn.functional.mse_loss(decoder(encoder(z_B_d)), z_B_d)
                    optimizer.zero_grad()
                    loss.backward()
                    optimizer.step()

        @torch.inference_mode()
        def transform(z_S_d: np.ndarray) -> np.ndarray:
            with _one_thread(torch):
                return encoder(torch.from_numpy(z_S_d.astype(np.float32))).numpy()

        return transform


REDUCTIONS = {"none": None, "pca": PCA, "umap": UMAP, "autoencoder": Autoencoder}


def reduce(name: str, h_train_N_d: np.ndarray, h_S_d: np.ndarray, settings: dict, *axes: object) -> np.ndarray:
    """Fit a reduction on training embeddings and apply it: (S, components), float32; ``none`` changes nothing."""
    reduction = make_reduction(name, settings)
    if reduction is None:
        return np.asarray(h_S_d, np.float32)
    require_room(name, reduction, *h_train_N_d.shape)
    if not np.ptp(h_train_N_d, axis=0).any():
        raise InputError("training embeddings", "are all identical", "retrain the encoder")
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(h_train_N_d.astype(np.float64))
    z_train_N_d, z_S_d = (scaler.transform(h.astype(np.float64)) for h in (h_train_N_d, h_S_d))
    return reduction.fit(z_train_N_d, *axes)(z_S_d).astype(np.float32)


def require_room(name: str, reduction: PCA | UMAP | Autoencoder, n: int, d: int | None) -> None:
    """Raise an InputError if components or neighbors are too many for n training embeddings of d numbers, if known."""
    if reduction.components > min(n, d or n):
        dimensions = f" of {d} numbers" if d else ""
        fault = f"{reduction.components} components are too many for {n} training embeddings{dimensions}"
        raise InputError(f"reduction '{name}'", fault, f"set components to at most {min(n, d or n)}")
    if isinstance(reduction, UMAP):
        # Beyond these limits umap-learn takes fewer neighbors, or starts at random, with no more than a warning.
        for key, most in (("neighbours", n - 1), ("components", n - 3)):
            if (value := getattr(reduction, key)) > most:
                fault = f"{value} {key} are too many for {n} training embeddings"
                raise InputError(f"reduction '{name}'", fault, f"lower {key}")


def make_reduction(name: str, settings: dict):
    """Return the reduction with its settings, None for ``none``; an unknown name or setting raises an InputError."""
    require_known("reduction", name, REDUCTIONS)
    reduction = REDUCTIONS[name]
    require_arguments(f"reduction '{name}'", reduction or (lambda: None), 0, settings)
    return reduction(**settings) if reduction else None


@cache
def _umap_learn() -> type:
    """Return umap-learn's class, whose loops are kept compiled: it would compile them in each process, for 12 s."""
    from numba.core.dispatcher import Dispatcher
    from umap import UMAP as UmapLearn
    from umap import distances, layouts, umap_, utils

    for module in (distances, layouts, umap_, utils):
        for loop in vars(module).values():
            if isinstance(loop, Dispatcher) and not loop.signatures:
                loop.enable_caching()
    return UmapLearn


@contextmanager
def _one_thread(torch) -> Iterator[None]:
    """Limit torch to one thread: sums over a batch depend on the number of threads."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
