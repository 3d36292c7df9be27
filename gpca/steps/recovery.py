"""Step ``recover``: failures on virtual tables, every policy's recovery from them, and one failure as pictures."""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gpca.errors import InputError
from gpca.frames.dataset import simplified
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.rgbd_scene import TABLE_COLOR, model_color
from gpca.frames.shots import Shot, best_viewpoint
from gpca.frames.situations import REDRAWS, Shelf, Situation, Situations
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.io.files import Axes, write_text
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.camera import MeshScene, shade
from gpca.objects.source import data_files, resolve, surfaces
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.process.progress import progress
from gpca.recovery import loop as closed_loop
from gpca.recovery.actions import FEWEST_POINTS, Action, Robot, action_of, look_around
from gpca.recovery.answers import learn_explainers
from gpca.recovery.chances import learn_utility
from gpca.recovery.episodes import Attempt, Episode, find_episodes, register_first
from gpca.recovery.policies import Means, best_order, policy_entry
from gpca.recovery.settings import LoopSettings, RecoverySettings
from gpca.rigid import inverse
from gpca.seeds import generator

# Names every random number of this step, tables included. The number is that of the draw: on the tables and cases of
# draw 1, results were seen between versions of the policies.
SOURCE = "recovery 2"
PARTS = ("train", "test", "rehearsals", "failures")  # no two share a table
ACTION = "new_view"  # that the example shows


def run(job: Job) -> None:
    """Learn the classifier, rehearse, find failures and let every policy act on them."""
    settings = RecoverySettings.from_sections(job.settings)
    recovery, loop = settings.section, settings.loop
    objects = resolve(dict(settings.objects), job.data_dir)
    actions = {name: action_of(name, of_action or {}) for name, of_action in recovery["actions"].items()}
    entries = [policy_entry(name, tuple(actions)) for name in recovery["policies"]]
    outputs = [job.rows, job.timings, job.policy, job.example]
    axes = (SOURCE, job.seed)
    with record_provenance(outputs, data_files(objects), job.settings, seed=job.seed):
        models = [simplified(surface) for surface in surfaces(objects, job.downloads)]
        shelf = Shelf(models, SOURCE, recovery["model_points"], InitialPoseSettings(**recovery["estimator"]))
        tables = {part: Situations(shelf, settings.situation, (*axes, part)) for part in PARTS}
        registered = register_situations(tables, recovery["train"], recovery["calibration"], loop)
        names = [name for name in dict.fromkeys(entry.explainer for entry in entries) if name]
        explain = learn_explainers(names, as_samples(registered), settings, *axes)
        learning = any(e.learns or e.queues or e.rehearsed or e.gated or e.alarmed for e in entries)
        rehearsals = replace(loop, failures=recovery["rehearsals"])
        rehearsed = find_episodes(tables["rehearsals"], rehearsals) if learning else []
        learner = next((entry.explainer for entry in entries if entry.learns or entry.queues), "")
        rehearsal = closed_loop.rehearse(rehearsed, actions, learner, explain[learner], loop) if learner else None
        means = Means(closed_loop.robot_policy(recovery, rehearsal), tuple(actions))
        reenactor = closed_loop.Reenactor(settings.reenactment, settings.counterfactuals)
        costs = recovery["costs"]
        if rehearsal:
            utility = learn_utility(rehearsal.trials.values(), costs, tuple(actions), recovery["needless"])
            means = replace(means, utility=utility)
        if any(entry.rehearsed for entry in entries):
            solved = [partial(each.solved_by, by_name=actions, settings=loop) for each in rehearsed if each.failed]
            means = replace(means, order=best_order(tuple(actions), costs, solved, loop.budget))
        if any(entry.gated for entry in entries):
            parts = registered | {"rehearsals": rehearsed}
            means = replace(means, gate=closed_loop.rehearsed_gate(parts, recovery["gate"]["false_alarms"]))
        if any(entry.alarmed for entry in entries):
            fresh = [*registered["train"], *registered["test"], *rehearsed]  # of which it has learned nothing
            alarm = closed_loop.calibrated_alarm(fresh, reenactor, recovery["gate"]["false_alarms"])
            means = replace(means, alarm=alarm)
        content = closed_loop.summary(means)
        print(json.dumps(content), file=sys.stderr)
        write_text(job.policy, json.dumps(content, indent=1, sort_keys=True) + "\n")
        episodes = find_episodes(tables["failures"], loop)
        closed = closed_loop.Loop(episodes, actions, explain, means, loop, axes, reenactor)
        rows, seconds = closed.run(recovery["policies"])
        write_csv(job.rows, rows)
        write_csv(job.timings, seconds)
        views = recovery["actions"].get(ACTION) or {}
        save_example(job.example, episodes, rows, {ACTION: action_of(ACTION, views)} | actions, views, loop, axes)


def register_situations(
    situations: Mapping[str, Situations], train: int, calibration: int, settings: LoopSettings
) -> dict[str, list[Episode]]:
    """Register situations of the causes in turn, failed or not; what is learned is calibrated on split ``test``."""
    registered: dict[str, list[Episode]] = {"train": [], "test": []}
    for split, count in (("train", train), ("test", calibration)):
        for number in progress(range(count), f"situations of split {split}"):
            cause = CONCEPTS[number % len(CONCEPTS)]
            for redraw in range(REDRAWS):
                situation, _ = situations[split].draw(cause, cause, number, redraw)
                start = register_first(situation, settings)
                if start is not None:
                    break
            else:
                fault = f"{REDRAWS} views of its objects show fewer than {FEWEST_POINTS} points of them"
                raise InputError("the virtual camera", fault, "give recovery.camera more pixels")
            registered[split].append(Episode(number, situation, start, settings.success))
    return registered


def as_samples(registered: Mapping[str, Iterable[Episode]]) -> Registrations:
    records = [
        episode.outcomes[()].record | {"sample": episode.number, "split": split}
        for split, of_split in registered.items()
        for episode in of_split
    ]
    return as_registrations(records)[0]


def choose_example(rows: Frame) -> Any:
    """Return the row that is shown: of overlap, solved by a new view by GP-CA's policy, its score the median."""
    shown = "gpca" if (rows["policy"] == "gpca").any() else rows["policy"].iloc[0]
    first = rows[rows["failed"] & (rows["step"] == 1) & (rows["policy"] == shown)]
    for wish in (first["cause"] == "overlap", first["action"] == ACTION, first["recovered"]):
        if (wish := wish.reindex(first.index)).any():
            first = first[wish]
    return first.sort_values(["score_overlap", "episode"]).iloc[len(first) // 2]


def save_example(
    path: str | Path,
    episodes: Sequence[Episode],
    rows: Frame,
    actions: Mapping[str, Action],
    views: Mapping[str, Any],
    settings: LoopSettings,
    axes: Axes,
) -> None:
    """Write the npz: of the ``first`` and the ``next`` view the image and silhouettes; scores, errors; viewpoints."""
    shown = choose_example(rows)
    episode = next(e for e in episodes if e.number == shown["episode"])
    before, after = episode.outcomes[()], episode.take((ACTION,), actions, settings)
    situation = episode.situation
    random = generator(*situation.axes, "action", ACTION)  # the one that the action had
    poses_n, seen_Q, shown_n_Q = look_around(before.holding, Robot(situation), random, **views)
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
    colors_M_3 = np.array([*(model_color(p.model, len(surfaces)) for p in situation.standing), TABLE_COLOR])
    model = surfaces[situation.model]
    alone = MeshScene([(model.vertices_m, model.triangles)])
    poses = {"true": situation.T_world_object, "placed": outcome.holding.T_world_object}
    silhouettes = {
        f"{pose}_{name}": alone.silhouette(shot.camera, inverse(T_world_object) @ shot.T_world_camera)
        for pose, T_world_object in poses.items()
    }
    return {f"image_{name}": shade(view, colors_M_3, shot.T_world_camera), f"mask_{name}": shot.mask, **silhouettes}
