"""Step ``recover``: settings -> failures on virtual scenes, and every policy's recovery from them."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from gpca.experiments.recovery.episodes import Episode, find_episodes
from gpca.experiments.recovery.example import ACTION, save_example
from gpca.experiments.recovery.loop import Loop
from gpca.experiments.recovery.loop_explainers import LoopExplainers, learn_explainers
from gpca.experiments.recovery.queueing import error_by_labels, learners_of
from gpca.experiments.recovery.reenactor import Reenactor, calibrated_alarm
from gpca.experiments.recovery.rehearsal import (
    Rehearsal,
    rehearse,
    rehearsed_gate,
    rehearsed_order,
    robot_policy,
    summary,
)
from gpca.experiments.recovery.virtual_tables import as_samples, lay_tables, register_situations
from gpca.io.csv_file import write_csv
from gpca.io.files import whole_file
from gpca.objects.source import data_files, resolve, surfaces
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.recovery.actions import Action, action_of
from gpca.recovery.chances import learn_utility
from gpca.recovery.policies import Means, PolicyEntry, policy_entry
from gpca.recovery.settings import LoopSettings, RecoverySettings

# Names every random number of this step, tables included. The number is that of the draw: on the tables and cases of
# draw 1, results were seen between versions of the policies.
SOURCE = "recovery 2"


def run(job: Job) -> None:
    """Learn the classifier, rehearse, find failures and let every policy act on them."""
    settings = RecoverySettings.from_sections(job.settings)
    recovery = settings.section
    loop = settings.loop
    objects = resolve(dict(settings.objects), job.data_dir)
    actions = {name: action_of(name, of_action or {}) for name, of_action in recovery["actions"].items()}
    entries = [policy_entry(name, tuple(actions)) for name in recovery["policies"]]
    outputs = [job.rows, job.timings, job.queue, job.policy, job.example]
    axes = (SOURCE, job.seed)
    with record_provenance(outputs, data_files(objects), job.settings, seed=job.seed):
        tables = lay_tables(surfaces(objects, job.downloads), settings, *axes)
        registered = register_situations(tables, recovery["train"], recovery["calibration"], loop)
        explainers = learn_explainers(
            [name for name in dict.fromkeys(entry.explainer for entry in entries) if name],
            as_samples(registered),
            settings.encoder,
            settings.explainers,
            settings.uncertainty,
            recovery["remedied"],
            *axes,
        )
        learning = any(e.learns or e.queues or e.rehearsed or e.gated or e.alarmed for e in entries)
        rehearsals = replace(loop, failures=recovery["rehearsals"])
        rehearsed = find_episodes(tables["rehearsals"], rehearsals) if learning else []
        rehearsal = _rehearse(rehearsed, entries, actions, explainers, loop)
        means = _means(recovery, entries, actions, registered, rehearsed, rehearsal, loop)
        reenactor = Reenactor(settings.reenactment, settings.counterfactuals)
        if any(entry.alarmed for entry in entries):
            fresh = [*registered["train"], *registered["test"], *rehearsed]  # of which it has learned nothing
            means = replace(means, alarm=calibrated_alarm(fresh, reenactor, recovery["gate"]["false_alarms"]))
        _write_summary(job.policy, summary(means, explainers))
        episodes = find_episodes(tables["failures"], loop)
        rows, seconds = Loop(episodes, actions, explainers.explain, means, loop, axes, reenactor).run(
            recovery["policies"]
        )
        judged = [episode for episode in episodes if episode.failed]
        solved = [{name: episode.solved_by((name,), actions, loop) for name in actions} for episode in judged]
        learners = learners_of(recovery["policies"], means, rehearsal, judged, explainers, loop.budget)
        write_csv(job.queue, error_by_labels(learners, solved, rehearsal, axes))
        write_csv(job.rows, rows)
        write_csv(job.timings, seconds)
        views = recovery["actions"].get(ACTION) or {}
        save_example(job.example, episodes, rows, {ACTION: action_of(ACTION, views)} | actions, views, loop, axes)


def _rehearse(
    rehearsed: Sequence[Episode],
    entries: Sequence[PolicyEntry],
    actions: Mapping[str, Action],
    explainers: LoopExplainers,
    loop: LoopSettings,
) -> Rehearsal | None:
    """Return the trials of the rehearsals, if there is a policy that learns from them."""
    learner = next((entry.explainer for entry in entries if entry.learns or entry.queues), "")
    return rehearse(rehearsed, actions, learner, explainers.explain[learner], loop) if learner else None


def _means(
    recovery: Mapping,
    entries: Sequence[PolicyEntry],
    actions: Mapping[str, Action],
    registered: Mapping[str, Sequence[Episode]],
    rehearsed: Sequence[Episode],
    rehearsal: Rehearsal | None,
    loop: LoopSettings,
) -> Means:
    """Return what the policies are made from; what none of them needs is not learned."""
    costs, failures = recovery["costs"], [episode for episode in rehearsed if episode.failed]
    utility = order = gate = None
    if rehearsal:
        utility = learn_utility(rehearsal.trials.values(), costs, tuple(actions), recovery["needless"])
    if any(entry.rehearsed for entry in entries):
        order = rehearsed_order(failures, actions, costs, loop)
    if any(entry.gated for entry in entries):
        gate = rehearsed_gate({**registered, "rehearsals": rehearsed}, recovery["gate"]["false_alarms"])
    return Means(robot_policy(recovery, rehearsal), tuple(actions), utility, order or (), gate)


def _write_summary(path: Path, content: dict) -> None:
    print(json.dumps(content), file=sys.stderr)
    with whole_file(path) as partial:
        partial.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")
