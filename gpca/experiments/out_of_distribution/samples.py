"""Makes samples unlike those of the training, and measures how far they are from it.

Distances are in a space of features that is the same for every learner.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import Classifier, embed, train_encoder
from gpca.experiments.out_of_distribution.sets import SPACES, ShiftedSets
from gpca.experiments.out_of_distribution.settings import ShiftSettings
from gpca.explainers.analytical_features import analytical_features
from gpca.objects.canonical import ObjectClouds, drawn, unseen
from gpca.pairs.dataset import Registrations
from gpca.pairs.synthesis import make_registrations

PRINCIPAL_COMPONENTS = 16  # components in which embeddings are compared


def make_sets(
    objects: ObjectClouds,
    registrations: Registrations,
    other: Registrations | None,
    encoder: Classifier,
    encoder_settings: EncoderSettings,
    source: str,
    seed: int,
    settings: ShiftSettings,
) -> ShiftedSets:
    """Make, embed and measure all sets of one source and seed.

    Args:
        objects: of the source.
        registrations: of the source, with the encoder's embeddings attached.
        other: registrations of another source, whose test samples are the set `source`; without them it is left out,
            as the sets of unseen objects are where the source has a single one.
        encoder, encoder_settings: the source's encoder.
    """
    measured = [sets_of_encoder(objects, registrations, other, encoder, encoder_settings, source, seed, settings)]
    held_out_S = held_out(registrations, settings.held_out_share, source, seed)
    if held_out_S.any():
        parts = _of_unseen_objects(registrations, held_out_S, source, seed, settings)
        measured.append(_measured(parts, source, seed, settings))
    return ShiftedSets.joined(measured)


def sets_of_encoder(
    objects: ObjectClouds,
    registrations: Registrations,
    other: Registrations | None,
    encoder: Classifier,
    encoder_settings: EncoderSettings,
    source: str,
    seed: int,
    settings: ShiftSettings,
) -> ShiftedSets:
    """Make, embed and measure the sets of the source's encoder; arguments as of :func:`make_sets`."""
    beyond, _ = make_registrations(objects, f"{source} severity", seed, settings.beyond)
    parts = {"in_distribution": registrations, "severity": beyond}
    if other is not None:
        parts["source"] = other.subset(other.rows("test")[: settings.samples])
    for name in [name for name in parts if name != "in_distribution"]:
        h_S_d, _ = embed(encoder, parts[name], f"{source} {name}", seed, encoder_settings)
        parts[name] = replace(parts[name], attached={"embedding": h_S_d})
    return _measured(parts, source, seed, settings)


def held_out(registrations: Registrations, share: float, source: str, seed: int) -> np.ndarray:
    """Return which samples (S,) show families to be held out: the seed's fold, or a share of all; not the only one."""
    is_unseen = unseen(registrations.fold, seed)
    if is_unseen is None:
        is_unseen = drawn(registrations.cluster, share, source, seed, "held-out objects")
    return is_unseen


def _of_unseen_objects(
    registrations: Registrations, held_out_S: np.ndarray, source: str, seed: int, settings: ShiftSettings
) -> dict[str, Registrations]:
    """Train an encoder that never sees some objects; return the samples of seen objects, and those of unseen ones."""
    is_train_S = registrations.split == "train"
    train = np.flatnonzero(~held_out_S & is_train_S)[: settings.train]
    seen = registrations.subset(np.concatenate([train, np.flatnonzero(~held_out_S & ~is_train_S)]))
    # Training samples of objects that were held out are as unseen as test samples, which are few.
    rows = np.concatenate([np.flatnonzero(held_out_S & ~is_train_S), np.flatnonzero(held_out_S & is_train_S)])
    unseen = registrations.subset(rows[: settings.samples])
    name = f"{source} without objects"
    model, _ = train_encoder(seen, name, seed, settings.encoder)
    embedded = [replace(part, attached={"embedding": embed(model, part, name, seed, settings.encoder)[0]})
                for part in (seen, unseen)]  # fmt: skip
    # Numbered anew: samples of two splits of the registrations are test samples here.
    renamed: dict[str, Any] = {"split": np.full(len(unseen), "test"), "sample": np.arange(len(unseen))}
    return {"seen_objects": embedded[0], "objects": replace(embedded[1], **renamed)}


def _measured(parts: dict[str, Registrations], source: str, seed: int, settings: ShiftSettings) -> ShiftedSets:
    """Join sets of one encoder, the one with its training samples first, and measure the distances to these."""
    spaces = {
        "analytical": {
            name: analytical_features(part, source, seed, "distance", name, shape_points=settings.shape_points)
            for name, part in parts.items()
        },
        "embedding": {name: part.embedding for name, part in parts.items()},
    }
    home = next(iter(parts))
    train = parts[home].rows("train")
    joined = []
    for name, part in parts.items():
        test = np.flatnonzero(part.split == "test")
        distance_S_K = np.zeros((len(part), 2 * len(SPACES)))
        for i, space in enumerate(SPACES):
            features_N_F = spaces[space][home][train]
            query_S_F = spaces[space][name][test]
            if space == "embedding":
                features_N_F, query_S_F = principal_components(features_N_F, query_S_F)
            distance_S_K[test, 2 * i] = knn_distance(features_N_F, query_S_F, settings.neighbours)
            distance_S_K[test, 2 * i + 1] = mahalanobis_distance(features_N_F, query_S_F)
        kept = ("split", "sample", "concept", "object_name", "cluster")
        columns = {column: getattr(part, column) for column in kept}
        named = np.full(len(part), name)
        joined.append(ShiftedSets(set=named, h=part.embedding, distance=distance_S_K, **columns))
    return ShiftedSets.joined(joined)


def knn_distance(train_N_F: np.ndarray, query_S_F: np.ndarray, neighbours: int = 10) -> np.ndarray:
    """Return the mean Euclidean distance (S,) to the nearest training samples, all features standardized on these.

    Where there are fewer than `neighbours` training samples, to all of them.
    """
    from sklearn.neighbors import NearestNeighbors
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(train_N_F)
    nearest = NearestNeighbors(n_neighbors=min(neighbours, len(train_N_F))).fit(scaler.transform(train_N_F))
    return nearest.kneighbors(scaler.transform(query_S_F))[0].mean(axis=1)


def mahalanobis_distance(train_N_F: np.ndarray, query_S_F: np.ndarray) -> np.ndarray:
    """Return the distance (S,) to the mean of the training samples in units of their scatter.

    The covariance is that of the standardized features, shrunk after Ledoit & Wolf (2004).
    """
    from scipy.linalg import pinvh
    from sklearn.covariance import ledoit_wolf
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(train_N_F)
    precision_F_F = pinvh(ledoit_wolf(scaler.transform(train_N_F))[0])
    offsets_S_F = scaler.transform(query_S_F)
    return np.sqrt(np.maximum(np.einsum("sf,fg,sg->s", offsets_S_F, precision_F_F, offsets_S_F), 0))


def principal_components(train_N_d: np.ndarray, query_S_d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return both in the leading principal components of the standardized training embeddings."""
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    components = min(PRINCIPAL_COMPONENTS, *train_N_d.shape)
    reduction = make_pipeline(StandardScaler(), PCA(components, svd_solver="full")).fit(train_N_d)
    return reduction.transform(train_N_d), reduction.transform(query_S_d)
