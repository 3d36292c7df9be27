"""The samples of a track as NumPy arrays, a pandas frame, or a torch dataset."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gpca.causes.dataset import Causes, labels_of
from gpca.errors import InputError, require_known
from gpca.io.files import SPLITS
from gpca.io.frame import Frame
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.tracks.published import NOTHING_NAMED, label_numbers
from gpca.tracks.samples import TrackSamples
from gpca.tracks.track import HARD_TRACK, track_of

NO_LABEL = NOTHING_NAMED  # of borderline samples, which no measure counts


@dataclass(frozen=True)
class TrackData:
    """S registrations of a track. Lengths are relative to the object's diameter."""

    track: str
    source: str
    split: str | None  # None for both
    seed: int
    version: str  # of the published samples
    registrations: Registrations  # clouds, poses and ICP's results
    labels: tuple[str, ...]  # the C possible ones
    label: np.ndarray  # (S,) true; ``borderline`` between nominal and failed, which counts in no measure
    error: np.ndarray  # (S, 8) mean, with each subset of the causes alone: bit i of the column stands for cause i
    phi: np.ndarray  # (S, 3) contributions of noise, pose and overlap to the error
    causes: np.ndarray  # (S, 3) whether each is one of the causes

    def __len__(self) -> int:
        return len(self.registrations)

    def __repr__(self) -> str:
        split = self.split or "train and test"
        return f"<{len(self)} samples of {self.track} {self.version}: {self.source}, {split}, seed {self.seed}>"

    @property
    def sources(self) -> list[np.ndarray]:
        """The observed clouds (P, 3) float32 as aligned by ICP, in the frame of the targets."""
        return [self.registrations.cloud(row) for row in range(len(self))]

    @property
    def targets(self) -> list[np.ndarray]:
        """The models' clouds (Q, 3) float32."""
        return [self.registrations.target(row) for row in range(len(self))]

    def arrays(self) -> dict[str, np.ndarray]:
        """Return name -> array (S, …) for each quantity of the samples."""
        registrations = self.registrations
        names = ["sample", "split", "object_name", "cluster", "diameter_m", "fitness", "inlier_rmse"]
        names += [name for name in vars(registrations) if name.startswith(("severity_", "T_target_source_"))]
        truth = {name: getattr(self, name) for name in ("label", "error", "phi", "causes")}
        return {name: getattr(registrations, name) for name in names} | truth

    def frame(self) -> Frame:
        """Return a row per sample with all scalar quantities, and the true φ of each cause."""
        import pandas as pd

        arrays = self.arrays()
        columns: dict[str, Any] = {name: array for name, array in arrays.items() if array.ndim == 1}
        columns["points"] = np.diff(self.registrations.offsets)
        columns["target_points"] = np.diff(self.registrations.target_offsets)
        columns["error"] = self.error[:, -1]
        columns |= {f"phi_{concept}": self.phi[:, column] for column, concept in enumerate(CONCEPTS)}
        return pd.DataFrame(columns)

    def torch(self, points: int = 512):
        """Return a torch dataset of (source (points, 3), target (points, 3), label number), float32.

        Clouds are in random order, so their first points are a random subset; smaller clouds repeat points. Borderline
        samples have the label `NO_LABEL`, -1.
        """
        import torch

        label = torch.tensor(label_numbers(self.label.tolist(), self.labels).tolist())
        both = (self.sources, self.targets)
        clouds = [torch.from_numpy(np.stack([np.resize(cloud, (points, 3)) for cloud in each])) for each in both]
        return torch.utils.data.TensorDataset(*clouds, label)


def load(
    track: str = "causes",
    source: str | None = None,
    split: str | None = None,
    seed: int = 0,
    samples: str | Path | None = None,
    data_dir: str | Path | None = None,
) -> TrackData:
    """Return samples of a track, which are made from the repository's data where the cache lacks them.

    The track is ``causes``, ``hard``, ``frames`` or ``scans``, the source by default its first, the split ``train``,
    ``test`` or None for both (depth frames and scans are all for testing), the folder of samples by default the user's
    cache; `data_dir` has scans that the repository lacks. What is unknown or not as published raises an InputError.
    """
    folder, data = (Path(path) if path else None for path in (samples, data_dir))
    chosen = TrackSamples.of(track_of(track), folder, data_dir=data)
    parts = [(name, number) for name, number, _ in chosen.published.rows.parts()]
    source = source or parts[0][0]
    require_known("source", source, sorted({name for name, _ in parts}))
    if (source, seed) not in parts:
        seeds = ", ".join(str(number) for name, number in parts if name == source)
        raise InputError(f"seed {seed}", f"has no samples of the track {track}", f"choose one of {seeds}")
    if split is not None:
        require_known("split", split, SPLITS)
    if split == "train" and chosen.track.without_training:
        raise InputError("split 'train'", f"has no samples of the track {track}", chosen.track.without_training)
    [path] = chosen.files([chosen.track.file(source, seed)])
    causes = Causes.load(path, (source, seed))
    causes = causes.subset(causes.rows(split)) if split else causes
    truth, registrations = causes.truth, causes.registrations
    label_S = registrations.concept if track == HARD_TRACK else labels_of(truth)
    about = (track, source, split, seed, chosen.published.version, registrations, chosen.track.labels)
    return TrackData(*about, label_S, truth.error, truth.phi, truth.causes)
