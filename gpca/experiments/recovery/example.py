"""One failure as pictures and numbers, kept for Fig. 1: the view at first, from the new viewpoint, and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.rigid import inverse
from gpca.experiments.recovery.cases import Attempt, RobotIn
from gpca.experiments.recovery.episodes import Episode
from gpca.frames.camera import MeshScene, shade
from gpca.frames.rgbd_scene import TABLE_COLOR, model_color
from gpca.frames.shots import Shot, best_viewpoint
from gpca.frames.situations import Situation
from gpca.io.arrays import save_arrays
from gpca.io.files import Axes
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.actions import Action, look_around
from gpca.recovery.settings import LoopSettings
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

ACTION = "new_view"  # the figure shows this one


def choose_example(rows: pd.DataFrame) -> int:
    """Return the episode that is shown: of overlap, by GP-CA's policy a new view solved it, its score the median.

    Where there is none such, the narrower wishes are dropped from the last on.
    """
    shown = "gpca" if (rows["policy"] == "gpca").any() else rows["policy"].iloc[0]
    first = rows[rows["failed"] & (rows["step"] == 1) & (rows["policy"] == shown)]
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
    views: Mapping[str, Any],
    settings: LoopSettings,
    axes: Axes,
) -> None:
    """Write the npz: of the ``first`` and the ``next`` view the image and silhouettes; scores, errors; viewpoints.

    Silhouettes are those of the visible part of the object, of the whole object, and of the model where ICP put it. For
    each viewpoint that was to choose from there is the direction to it and the share of the model's surface that was
    expected to have been seen after it.

    Args:
        views: settings of the action that changes the viewpoint.
        axes: the source and the seed that the file is of.
    """
    episode = next(e for e in episodes if e.number == choose_example(rows))
    shown = rows[(rows["episode"] == episode.number) & (rows["step"] == 1)]
    shown = shown[shown["policy"] == "gpca"].iloc[0] if (shown["policy"] == "gpca").any() else shown.iloc[0]
    before, after = episode.outcomes[()], episode.take((ACTION,), actions, settings)
    situation = episode.situation
    random = generator(*situation.axes, "action", ACTION)  # the one that the action had
    poses_n, seen_Q, shown_n_Q = look_around(before.holding, RobotIn(situation), random, **views)
    arrays = {
        "object": np.array(situation.shelf.objects.names[situation.model]),
        "cause": np.array(situation.cause),
        "action": np.array(shown["action"]),
        "scores": np.nan_to_num([float(shown[f"score_{concept}"]) for concept in CONCEPTS]),
        "errors": np.array([before.error, after.error]),
        "viewpoints_n_3": -poses_n[:, :3, 2],
        "viewpoint_first": -before.holding.shots[0].T_world_camera[:3, 2],
        "surface_n": (seen_Q | shown_n_Q).mean(axis=1),
        "surface_first": np.array(seen_Q.mean()),
        "chosen": np.array(best_viewpoint(seen_Q, shown_n_Q)),
    }
    for name, shot, outcome in (("first", before.holding.shots[0], before), ("next", after.holding.shots[-1], after)):
        arrays |= _seen(name, situation, shot, outcome)
    save_arrays(path, arrays, axes)


def _seen(name: str, situation: Situation, shot: Shot, outcome: Attempt) -> dict[str, np.ndarray]:
    view = situation.meshes.look(shot.camera, shot.T_world_camera)
    surfaces = situation.shelf.surfaces
    colours_M_3 = np.array([*(model_color(p.model, len(surfaces)) for p in situation.standing), TABLE_COLOR])
    model = surfaces[situation.model]
    alone = MeshScene([(model.vertices_m, model.triangles)])
    poses = {"true": situation.T_world_object, "placed": outcome.holding.T_world_object}
    silhouettes = {
        f"{pose}_{name}": alone.silhouette(shot.camera, inverse(T_world_object) @ shot.T_world_camera)
        for pose, T_world_object in poses.items()
    }
    return {f"image_{name}": shade(view, colours_M_3, shot.T_world_camera), f"mask_{name}": shot.mask, **silhouettes}
