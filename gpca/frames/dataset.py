"""A dataset of depth frames on disk: its frames, its models, and what its scenes are for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.frames.bop import Frame, read_frames
from gpca.frames.estimates import PosesByObject, read_bop_results
from gpca.objects import bop
from gpca.objects.splits import DRAWN, EVALUATION, TRAINING, Place
from gpca.seeds import generator


@dataclass(frozen=True)
class Dataset:
    """A BOP dataset on disk.

    Attributes:
        name: seeds its draws and names its objects.
        folders: the dataset's, or those that its archives were unpacked in.
        unit: the unit of the models' vertices.
        split: the split whose frames are read.
        results: BOP results files with initial poses, one of each estimator.
        errors: CSV of errors that estimators made elsewhere on its objects, or None.
        models: the folder of its models where they are not in its own.
        most_frames: where there are more frames, so many are drawn; None reads all.
        places: of its scenes, by number; none where no file says so.
        role: what the frames are for: scenes for development are for training alone, or nothing else is read.
    """

    name: str
    folders: tuple[Path, ...]
    unit: str = "mm"
    split: str = "test"
    results: tuple[Path, ...] = ()
    errors: Path | None = None
    models: Path | None = None
    most_frames: int | None = 200
    places: Mapping[int, Place] = field(default_factory=dict)
    role: str = EVALUATION

    def frames(self) -> list[Frame]:
        """Return its frames, or a draw of them; InputError for a scene that the splits lack."""
        frames = [frame for frame in read_frames(self.folders, self.split) if self._is_read(frame)]
        if self.most_frames is None or len(frames) <= self.most_frames:
            return frames
        rows = generator(self.name, "frames").choice(len(frames), self.most_frames, replace=False)
        return [frames[row] for row in np.sort(rows)]

    def _is_read(self, frame: Frame) -> bool:
        if not self.places:
            return True
        if frame.scene not in self.places:
            fault = f"scene {frame.scene} is in no split"
            raise InputError(f"dataset {self.name}", fault, "add it to the file of scenes, or set splits.scenes: null")
        return self.role == EVALUATION or self.places[frame.scene].role == self.role

    def place(self, scene: int) -> Place:
        """Return where a scene stands; where no file says so, it may be tested and its poses are good."""
        return self.places.get(scene, Place(f"{self.name} {scene}", self.role, DRAWN))

    def fold(self, scene: int) -> int:
        """Return the fold that a scene is tested with, `DRAWN` where no file says so, `TRAINING` if it never is."""
        place = self.place(scene)
        return place.fold if place.role == self.role else TRAINING

    def estimators(self) -> dict[str, PosesByObject]:
        """Return the poses of each of its results files, by the name of the file."""
        if not self.results:
            return {}
        # Against all images, not only the drawn ones: a results file covers the whole dataset.
        distances_m = {
            frame.place: [float(np.linalg.norm(annotation.T_camera_model[:3, 3])) for annotation in frame.annotations]
            for frame in read_frames(self.folders, self.split)
        }
        known = bop.read_models_info(self.models_folder() / "models_info.json").keys()
        return {path.stem: read_bop_results(path, distances_m, known) for path in self.results}

    def models_folder(self) -> Path:
        """Return the folder of its models."""
        for folder in (self.models,) if self.models else self.folders:
            try:
                return bop.models_folder(folder)
            except InputError:
                continue
        raise InputError(", ".join(map(str, self.folders)), "has no models/obj_*.ply", "download the models too")
