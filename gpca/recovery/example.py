"""One failure as pictures and numbers, kept for Fig. 1: what was seen at first, from the new viewpoint, and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.rigid import inverse
from gpca.arrays import save_arrays
from gpca.frames.camera import shade
from gpca.frames.rgbd_scene import TABLE_COLOUR, model_colour
from gpca.frames.shots import Shot
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.actions import Action
from gpca.recovery.cases import Attempt
from gpca.recovery.episodes import Episode
from gpca.recovery.settings import LoopSettings

if TYPE_CHECKING:
    import pandas as pd

ACTION = "new_view"  # the figure shows this one
SHOWN_POINTS = 3000


def choose_example(rows: pd.DataFrame) -> int:
    """Return the episode that is shown: of overlap, by GP-CA's policy a new view solved it, its score the median.

    Where there is none such, the narrower wishes are dropped from the last on.
    """
    first = rows[(rows["step"] == 1) & (rows["policy"] == rows["policy"].iloc[0])]
    if (rows["policy"] == "gpca").any():
        first = rows[(rows["step"] == 1) & (rows["policy"] == "gpca")]
    for wish in (first["cause"] == "overlap", first["action"] == ACTION, first["recovered"]):
        if (wish := wish.reindex(first.index)).any():
            first = first[wish]
    ranked = first.sort_values(["score_overlap", "episode"])
    return int(ranked["episode"].iloc[len(ranked) // 2])


def save_example(
    path: str | Path,
    episodes: Sequence[Episode],
    rows: pd.DataFrame,
    actions: Mapping[str, Action],
    settings: LoopSettings,
) -> None:
    """Write the npz: of ``first`` and ``next`` image, K, object's box, poses ``T_camera_object``; scores, errors."""
    episode = next(e for e in episodes if e.number == choose_example(rows))
    shown = rows[(rows["episode"] == episode.number) & (rows["step"] == 1)]
    shown = shown[shown["policy"] == "gpca"].iloc[0] if (shown["policy"] == "gpca").any() else shown.iloc[0]
    before, after = episode.outcomes[()], episode.take((ACTION,), actions, settings)
    new = after.holding.shots[-1]
    objects = episode.situation.shelf.objects
    model = episode.situation.model
    arrays = {
        "camera_3_3": new.camera.matrix_3_3,
        "model_m": objects.points(model)[:SHOWN_POINTS],
        "object": np.array(objects.names[model]),
        "cause": np.array(episode.situation.cause),
        "action": np.array(shown["action"]),
        "scores": np.nan_to_num([float(shown[f"score_{concept}"]) for concept in CONCEPTS]),
        "errors": np.array([before.error, after.error]),
    }
    for name, shot, outcome in (("first", before.holding.shots[0], before), ("next", new, after)):
        arrays |= _seen(name, episode, shot, outcome)
    save_arrays(path, arrays)


def _seen(name: str, episode: Episode, shot: Shot, outcome: Attempt) -> dict[str, np.ndarray]:
    situation = episode.situation
    view = situation.meshes.look(shot.camera, shot.T_world_camera)
    count = len(situation.shelf.surfaces)
    colours_M_3 = np.array([*(model_colour(p.model, count) for p in situation.standing), TABLE_COLOUR])
    return {
        f"image_{name}": shade(view, colours_M_3, shot.T_world_camera),
        f"mask_{name}": shot.mask,
        f"T_camera_object_{name}": inverse(shot.T_world_camera) @ outcome.holding.T_world_object,
    }
