"""Steps ``shift`` and ``fit_learners``: samples unlike those of the training, and what learners predict for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated

import numpy as np

from gpca.attribution.predictions import prediction_frame
from gpca.encoders.registry import EncoderSettings
from gpca.explainers.analytical_features import analytical_features
from gpca.explainers.interface import ConceptExplainer
from gpca.explainers.registry import Embed, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds, drawn, unseen
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.shifted_sets import DISTANCES, TRAINED_ON, ShiftedSets
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.progress import progress
from gpca.settings import Bounds, Count, OpenShare, read_settings

PRINCIPAL_COMPONENTS = 16  # of embeddings, for their distances


@dataclass(frozen=True)
class ShiftSettings:
    """Samples unlike those of the training, and how their distance to it is measured."""

    beyond: RegistrationSettings  # of larger severities
    encoder: EncoderSettings  # the one that never sees some objects
    samples: Annotated[int, Bounds(minimum=3)] = 90  # of another source, and of objects never seen, at most
    held_out_share: OpenShare = 0.2  # of the objects, at least one, that this encoder and the learners on it never see
    train: Annotated[int, Bounds(minimum=3)] = 300  # training samples of that encoder, at most
    neighbours: Count = 10  # nearest training samples in the mean distance
    shape_points: Annotated[int, Bounds(minimum=4)] = 128  # at which the local shape is measured for the distances

    @classmethod
    def from_dicts(cls, shift: dict, registrations: dict, encoder: dict) -> ShiftSettings:
        """Build from the config's section ``shift``, and what it shares with the registrations and the encoder."""
        shift = dict(shift)
        samples = shift.get("samples", cls.samples)
        severities = shift.pop("severities", {})
        beyond = read_settings(RegistrationSettings, registrations | {"severities": severities})
        beyond = replace(beyond, train=0, test=samples)
        trained = EncoderSettings(**encoder | shift.pop("encoder", {}))
        return cls(beyond=beyond, encoder=trained, **shift)


def shift(job: Job) -> None:
    from gpca.encoders.training import embedding_by, load_model

    settings = ShiftSettings.from_dicts(**job.settings)
    encoder_settings = EncoderSettings(**job.section("encoder"))
    objects = ObjectClouds.load(job.objects, job.source)
    others = job.get("other_registrations", [None] * len(job.seeds))
    per_seed = job.per_seed("registrations", "embeddings", "encoders", "out")
    for (seed, path, embeddings, weights, out), other_path in zip(per_seed, others, strict=True):
        inputs = [each for each in (job.objects, path, other_path, embeddings, weights) if each]
        with record_provenance([out], inputs, job.settings, seed=seed):
            axes = (job.source, seed)
            registrations = Registrations.load(path, axes)
            registrations = replace(registrations, attached=read_embedding(embeddings, registrations))
            other = Registrations.load(other_path) if other_path else None
            embed_own = embedding_by(load_model(weights, encoder_settings, axes=axes), seed, encoder_settings)
            make_sets(objects, registrations, other, embed_own, *axes, settings).save(out, axes)


def fit_learners(job: Job) -> None:
    for i, (seed, path) in enumerate(job.per_seed("sets")):
        sets = ShiftedSets.load(path, (job.source, seed))
        outputs = job.out[i :: len(job.seeds)]
        title = f"learners on {job.source}, seed {seed}"
        for learner, out in progress(list(zip(job.learners, outputs, strict=True)), title):
            settings = job.section(learner)
            with record_provenance([out], [path], settings, seed=seed):
                make = partial(explainer_entry(learner).make, job.source, seed, **settings)
                write_csv(out, predict_sets(make, sets))


def predict_sets(make: Callable[[], ConceptExplainer], sets: ShiftedSets) -> Frame:
    """Predictions, after the column ``set``: a new learner learns from the training samples of each encoder."""
    import pandas as pd

    frames = []
    for home in dict.fromkeys(TRAINED_ON.values()):
        names = [name for name, trained_on in TRAINED_ON.items() if trained_on == home]
        rows = np.concatenate([sets.rows(name, "test") for name in names])
        if not len(rows):
            continue
        learner = make()
        learner.fit(sets.registrations(sets.rows(home, "train")))
        test = sets.registrations(rows)
        frames.append(prediction_frame(test, learner.explain(test.without_labels()), set=sets.set[rows]))
    return pd.concat(frames, ignore_index=True)


def make_sets(
    objects: ObjectClouds,
    registrations: Registrations,
    other: Registrations | None,
    embed_own: Embed,
    source: str,
    seed: int,
    settings: ShiftSettings,
    unseen_objects: bool = True,
) -> ShiftedSets:
    """Make, embed by the source's encoder and measure all sets of one source and seed; `other` is another source's.

    The sets of unseen objects are those of an encoder that never sees some families: the seed's fold, or a share of
    all. They are left out where the source has a single family.
    """
    from gpca.encoders.training import embed, train_encoder

    beyond, _ = make_registrations(objects, f"{source} severity", seed, settings.beyond)
    parts = {"in_distribution": registrations, "severity": beyond}
    if other is not None:
        parts["source"] = other.subset(other.rows("test")[: settings.samples])
    for name in list(parts)[1:]:
        h_S_d, _ = embed_own(parts[name], f"{source} {name}")
        parts[name] = replace(parts[name], attached={"embedding": h_S_d})
    measured = [_measured(parts, source, seed, settings)]
    held_out_S = unseen(registrations.fold, seed)
    if held_out_S is None:
        held_out_S = drawn(registrations.cluster, settings.held_out_share, source, seed, "held-out objects")
    if unseen_objects and held_out_S.any():
        is_train_S = registrations.split == "train"
        train = np.flatnonzero(~held_out_S & is_train_S)[: settings.train]
        seen = registrations.subset(np.concatenate([train, np.flatnonzero(~held_out_S & ~is_train_S)]))
        # Training samples of objects that were held out are as unseen as test samples, which are few.
        rows = np.concatenate([np.flatnonzero(held_out_S & ~is_train_S), np.flatnonzero(held_out_S & is_train_S)])
        parts = {"seen_objects": seen, "objects": registrations.subset(rows[: settings.samples])}
        title = f"{source} without objects"
        model, _ = train_encoder(seen, title, seed, settings.encoder)
        for name, part in parts.items():
            h_S_d, _ = embed(model, part, title, seed, settings.encoder)
            parts[name] = replace(part, attached={"embedding": h_S_d})
        # Numbered anew: samples of two splits of the registrations are test samples here.
        count = len(parts["objects"])
        parts["objects"] = replace(parts["objects"], split=np.full(count, "test"), sample=np.arange(count))
        measured.append(_measured(parts, source, seed, settings))
    return ShiftedSets.joined(measured)


def _measured(parts: dict[str, Registrations], source: str, seed: int, settings: ShiftSettings) -> ShiftedSets:
    """Join sets of one encoder, the one with its training samples first, and measure the distances to these."""
    analytical = {
        name: analytical_features(part, source, seed, "distance", name, shape_points=settings.shape_points)
        for name, part in parts.items()
    }
    home = next(iter(parts))
    train = parts[home].rows("train")
    joined, kept = [], ("split", "sample", "concept", "object_name", "cluster")
    for name, part in parts.items():
        test = part.rows("test")
        by_shape = distances(analytical[home][train], analytical[name][test], settings.neighbours)
        embedded = principal_components(parts[home].embedding[train], part.embedding[test])
        distance_S_K = np.zeros((len(part), len(DISTANCES)))
        distance_S_K[test] = np.hstack([by_shape, distances(*embedded, settings.neighbours)])
        columns = {column: getattr(part, column) for column in kept}
        joined.append(ShiftedSets(set=np.full(len(part), name), h=part.embedding, distance=distance_S_K, **columns))
    return ShiftedSets.joined(joined)


def distances(train_N_F: np.ndarray, query_S_F: np.ndarray, neighbours: int) -> np.ndarray:
    """Return the standardized distance (S, 2) to the nearest training samples on average, and by their covariance."""
    from scipy.linalg import pinvh
    from sklearn.covariance import ledoit_wolf
    from sklearn.neighbors import NearestNeighbors
    from sklearn.preprocessing import StandardScaler

    scaler = StandardScaler().fit(train_N_F)
    train_N_F, offsets_S_F = scaler.transform(train_N_F), scaler.transform(query_S_F)
    nearest = NearestNeighbors(n_neighbors=min(neighbours, len(train_N_F))).fit(train_N_F)
    precision_F_F = pinvh(ledoit_wolf(train_N_F)[0])
    squares_S = np.maximum(np.einsum("sf,fg,sg->s", offsets_S_F, precision_F_F, offsets_S_F), 0)
    return np.stack([nearest.kneighbors(offsets_S_F)[0].mean(axis=1), np.sqrt(squares_S)], axis=1)


def principal_components(train_N_d: np.ndarray, query_S_d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    from sklearn.decomposition import PCA
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    components = min(PRINCIPAL_COMPONENTS, *train_N_d.shape)
    reduction = make_pipeline(StandardScaler(), PCA(components, svd_solver="full")).fit(train_N_d)
    return reduction.transform(train_N_d), reduction.transform(query_S_d)
