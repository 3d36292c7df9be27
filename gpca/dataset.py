"""The registrations of one source and seed: perturbed pairs, aligned by ICP, labelled with their concept."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from gpca.errors import InputError
from gpca.files import load_arrays, save_arrays
from gpca.objects.canonical import ObjectClouds
from gpca.perturbation import CONCEPTS, PERTURBATIONS, Severities
from gpca.progress import progress
from gpca.registration import ICP, ICPSettings
from gpca.rigid import scale_translation, transform
from gpca.seeds import generator

SPLITS = ("train", "test")


@dataclass(frozen=True)
class Registrations:
    """S registrations. Lengths are relative to the object's diameter unless the name ends in ``_m``.

    Attributes:
        sample: (S,) number of the sample within its split.
        split: (S,) ``train`` or ``test``.
        concept: (S,) what was perturbed: ``noise``, ``pose`` or ``overlap``.
        object_index, object_name, diameter_m: (S,) the object registered.
        points: (ΣP, 3) float32, the ICP-aligned source clouds in the target's frame; cloud i is
            ``points[offsets[i]:offsets[i + 1]]``.
        severity_noise, severity_rotation_rad, severity_translation, severity_crop: (S,) as drawn, 0 where not applied.
        T_target_source_true, T_target_source_init, T_target_source_icp: (S, 4, 4), translations in metres.
        fitness, inlier_rmse: (S,) of ICP.
        embedding: (S, d) of an encoder, for explainers that read it; in a file of its own.
    """

    sample: np.ndarray
    split: np.ndarray
    concept: np.ndarray
    object_index: np.ndarray
    object_name: np.ndarray
    diameter_m: np.ndarray
    points: np.ndarray
    offsets: np.ndarray
    severity_noise: np.ndarray
    severity_rotation_rad: np.ndarray
    severity_translation: np.ndarray
    severity_crop: np.ndarray
    T_target_source_true: np.ndarray
    T_target_source_init: np.ndarray
    T_target_source_icp: np.ndarray
    fitness: np.ndarray
    inlier_rmse: np.ndarray
    embedding: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.sample)

    def cloud(self, i: int) -> np.ndarray:
        """Return the aligned source cloud (P, 3) of row i."""
        return self.points[self.offsets[i] : self.offsets[i + 1]]

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return np.flatnonzero(self.split == split)

    def subset(self, rows: np.ndarray) -> Registrations:
        """Return the given rows, in the given order."""
        columns = {name: getattr(self, name)[rows] for name in COLUMNS}
        if self.embedding is not None:
            columns["embedding"] = self.embedding[rows]
        return replace(self, **columns, **_ragged([self.cloud(i) for i in rows]))

    def without_labels(self) -> Registrations:
        """Return the same registrations as an explainer may see them: nothing that tells what was perturbed."""
        nan_S = np.full(len(self), np.nan)
        unknown = dict.fromkeys((name for name in COLUMNS if name.startswith("severity_")), nan_S)
        unknown["T_target_source_true"] = np.full_like(self.T_target_source_true, np.nan)
        return replace(self, concept=np.full(len(self), ""), **unknown)

    def save(self, path: str | Path) -> None:
        """Write the npz described in results/README.md."""
        save_arrays(path, {name: getattr(self, name) for name in (*COLUMNS, "points", "offsets")})

    @classmethod
    def load(cls, path: str | Path) -> Registrations:
        """Read the npz.

        Raises:
            InputError: the file is missing, damaged, holds pickled objects, wrong shapes, NaN or unknown labels.
        """
        shapes: dict[str, tuple[int | str, ...]] = dict.fromkeys(COLUMNS, ("S",))
        shapes |= {name: ("S", 4, 4) for name in COLUMNS if name.startswith("T_")}
        shapes |= {"points": ("P", 3), "offsets": ("O",)}
        arrays = load_arrays(path, shapes, made_by="python -m gpca registrations")
        remedy = "make it anew with 'python -m gpca registrations'"
        offsets = arrays["offsets"]
        if len(offsets) != len(arrays["sample"]) + 1 or offsets[0] != 0 or offsets[-1] != len(arrays["points"]):
            raise InputError(path, "'offsets' do not match 'points' and 'sample'", remedy)
        if len(offsets) == 1 or (np.diff(offsets) < 3).any():
            raise InputError(path, "holds no samples, or a cloud of fewer than 3 points", remedy)
        for name, known in (("split", SPLITS), ("concept", CONCEPTS)):
            if unknown := set(arrays[name].tolist()) - set(known):
                raise InputError(path, f"unknown {name} {sorted(unknown)[0]!r}", f"known are {', '.join(known)}")
        return cls(**{name: arrays[name] for name in shapes})


NOT_COLUMNS = ("points", "offsets", "embedding")
COLUMNS = tuple(field.name for field in fields(Registrations) if field.name not in NOT_COLUMNS)


@dataclass(frozen=True)
class RegistrationSettings:
    """How many registrations are made and how (docs/protocol.md).

    Attributes:
        train, test: samples of each split, balanced over concepts and objects.
        points: points of source and target (fewer where the object has fewer than twice as many).
        severities: ranges of the perturbations.
        icp: how ICP runs.
    """

    train: int = 800
    test: int = 200
    points: int = 2048
    severities: Severities = field(default_factory=Severities)
    icp: ICPSettings = field(default_factory=ICPSettings)

    @classmethod
    def from_dict(cls, settings: dict) -> RegistrationSettings:
        """Build from the config's section ``registrations``."""
        settings = dict(settings)
        severities = {name: tuple(limits) for name, limits in settings.pop("severities", {}).items()}
        return cls(severities=Severities(**severities), icp=ICPSettings(**settings.pop("icp", {})), **settings)


def make_registrations(
    objects: ObjectClouds, source: str, seed: int, settings: RegistrationSettings
) -> tuple[Registrations, np.ndarray]:
    """Perturb, align by ICP and label: the data set of one source and seed.

    Samples 3t, 3t + 1 and 3t + 2 of a split show object t mod O under the three concepts in random order. Everything
    random in a sample comes from generators named by source, seed, split and number, so that it does not depend on
    how many samples there are.

    Returns:
        the registrations, and the seconds (S,) that ICP took for each.
    """
    samples = [(split, n) for split in SPLITS for n in range(getattr(settings, split))]
    records = []
    for split, n in progress(samples, f"registrations of {source}, seed {seed}"):
        deal, place = divmod(n, len(CONCEPTS))
        concept = generator(source, seed, "concepts", split, deal).permutation(CONCEPTS)[place]
        object_index = deal % len(objects)
        random = generator(source, seed, "registration", split, n)
        record = _register_one(objects, object_index, concept, settings, random)
        records.append(record | {"sample": n, "split": split})
    columns = {name: np.array([record[name] for record in records]) for name in COLUMNS}
    registrations = Registrations(**columns, **_ragged([record["cloud"] for record in records]))
    return registrations, np.array([record["icp_seconds"] for record in records])


def _register_one(
    objects: ObjectClouds, object_index: int, concept: str, settings: RegistrationSettings, random: np.random.Generator
) -> dict:
    diameter_m = float(objects.diameters_m[object_index])
    points = objects.points(object_index) / diameter_m
    n_points = min(settings.points, len(points) // 2)
    # Disjoint draws: a point seen in both clouds would have distance zero, and that gives the concept away.
    order = random.permutation(len(points))
    source_rows, target_rows = order[:n_points], order[n_points : 2 * n_points]

    perturbed = PERTURBATIONS[concept](points[source_rows], settings.severities, random)
    T_init = np.eye(4)
    started = perf_counter()
    icp = ICP(points[target_rows], objects.normals(object_index)[target_rows], settings.icp)
    registration = icp.register(perturbed.points, T_init)
    icp_seconds = perf_counter() - started
    severity = {name: perturbed.severity.get(name, 0.0) for name in ("noise", "rotation_rad", "translation", "crop")}
    return {
        "concept": concept,
        "object_index": object_index,
        "object_name": str(objects.names[object_index]),
        "diameter_m": diameter_m,
        "cloud": transform(registration.T_target_source, perturbed.points).astype(np.float32),
        "T_target_source_true": scale_translation(perturbed.T_target_source_true, diameter_m),
        "T_target_source_init": T_init,
        "T_target_source_icp": scale_translation(registration.T_target_source, diameter_m),
        "icp_seconds": icp_seconds,
        "fitness": registration.fitness,
        "inlier_rmse": registration.inlier_rmse,
        **{f"severity_{name}": value for name, value in severity.items()},
    }


def _ragged(clouds: list[np.ndarray]) -> dict[str, np.ndarray]:
    offsets = np.concatenate([[0], np.cumsum([len(cloud) for cloud in clouds])])
    return {"points": np.concatenate(clouds), "offsets": offsets.astype(np.int64)}
