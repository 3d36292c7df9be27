"""Step ``recover``: settings -> failures on virtual scenes, and every policy's recovery from them."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

from gpca.experiments.recovery.episodes import find_episodes, is_right
from gpca.experiments.recovery.example import ACTION, save_example
from gpca.experiments.recovery.loop import Loop
from gpca.experiments.recovery.loop_explainers import learn_explainers
from gpca.experiments.recovery.queueing import error_by_labels, learners_of
from gpca.experiments.recovery.rehearsal import rehearse, robot_policy, summary
from gpca.experiments.recovery.virtual_tables import lay_tables, register_situations
from gpca.io.csv_file import write_csv
from gpca.io.files import whole_file
from gpca.objects.source import data_files, resolve, surfaces
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.recovery.actions import action_of
from gpca.recovery.chances import learn_utility
from gpca.recovery.policies import Means, policy_entry
from gpca.recovery.settings import RecoverySettings

SOURCE = "recovery"  # names every random number of this step, tables included


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
        registrations = register_situations(tables, recovery["train"], recovery["calibration"], loop)
        explainers = learn_explainers(
            [name for name in dict.fromkeys(entry.explainer for entry in entries) if name],
            registrations,
            settings.encoder,
            settings.explainers,
            settings.uncertainty,
            recovery["remedied"],
            *axes,
        )
        rehearsal = utility = None
        if learner := next((entry.explainer for entry in entries if entry.learns or entry.queues), ""):
            training = find_episodes(tables["rehearsals"], replace(loop, failures=recovery["rehearsals"]))
            rehearsal = rehearse(training, actions, learner, explainers.explain[learner], loop)
            taught = rehearsal.trials.values()
            utility = learn_utility(taught, recovery["costs"], tuple(actions), recovery["needless"])
        policy = robot_policy(recovery, rehearsal)
        _write_summary(job.policy, summary(policy, explainers))
        means = Means(policy, tuple(actions), utility)
        episodes = find_episodes(tables["failures"], loop)
        rows, seconds = Loop(episodes, actions, explainers.explain, means, loop, axes).run(recovery["policies"])
        judged = [episode for episode in episodes if episode.failed]
        solved = [{name: is_right(e.take((name,), actions, loop)) for name in actions} for e in judged]
        learners = learners_of(recovery["policies"], means, rehearsal, judged, explainers, loop.budget)
        write_csv(job.queue, error_by_labels(learners, solved, rehearsal, axes))
        write_csv(job.rows, rows)
        write_csv(job.timings, seconds)
        views = recovery["actions"].get(ACTION) or {}
        save_example(job.example, episodes, rows, {ACTION: action_of(ACTION, views)} | actions, views, loop, axes)


def _write_summary(path: Path, content: dict) -> None:
    print(json.dumps(content), file=sys.stderr)
    with whole_file(path) as partial:
        partial.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")
