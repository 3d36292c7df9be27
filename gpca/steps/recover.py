"""Step ``recover``: settings -> failures on virtual scenes, and what every policy of recovery makes of them."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

import torch

from gpca.arguments import SEED
from gpca.csv_file import write_csv
from gpca.files import whole_file
from gpca.provenance import record_provenance
from gpca.recovery.actions import action_of
from gpca.recovery.calibration import robot_policy, summary
from gpca.recovery.episodes import find_failures
from gpca.recovery.example import save_example
from gpca.recovery.loop import Loop
from gpca.recovery.loop_explainers import learn_explainers
from gpca.recovery.policies import policy_entry
from gpca.recovery.settings import RecoverySettings
from gpca.recovery.virtual_tables import lay_tables, register_situations

SOURCE = "recovery"  # names every random number of this step, tables included


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files; ``--settings`` holds the sections of the config that are read."""
    parser.add_argument("--seed", required=True, type=SEED)
    parser.add_argument("--out", required=True, type=Path, help="CSV: a row per failure, policy and step")
    parser.add_argument("--timings", required=True, type=Path, help="CSV of their seconds")
    parser.add_argument("--policy", required=True, type=Path, help="JSON of the thresholds chosen")
    parser.add_argument("--example", required=True, type=Path, help="npz of one failure, for the figure")


def run(options: Namespace) -> None:
    """Learn the classifier, find failures and let every policy act on them."""
    torch.set_num_threads(options.threads)
    settings = RecoverySettings.from_sections(options.settings)
    recovery = settings.section
    loop = settings.loop
    actions = {name: action_of(name, given or {}) for name, given in recovery["actions"].items()}
    explainers_read = [policy_entry(name, tuple(actions)).explainer for name in recovery["policies"]]
    outputs = [options.out, options.timings, options.policy, options.example]
    axes = (SOURCE, options.seed)
    with record_provenance(outputs, [], options.settings, seed=options.seed):
        tables = lay_tables(settings, *axes)
        registrations, failed_S = register_situations(tables, recovery["train"], recovery["calibration"], loop)
        explainers = learn_explainers(
            [name for name in dict.fromkeys(explainers_read) if name],
            registrations,
            settings.encoder,
            settings.explainers,
            settings.uncertainty,
            recovery["remedied"],
            *axes,
        )
        policy = robot_policy(recovery, explainers, failed_S[registrations.rows("test")])
        _write_summary(options.policy, summary(policy, explainers))
        episodes = find_failures(tables["failures"], loop)
        rows, seconds = Loop(episodes, actions, explainers.explain, policy, loop, axes).run(recovery["policies"])
        write_csv(options.out, rows)
        write_csv(options.timings, seconds)
        save_example(options.example, episodes, rows, actions, loop)


def _write_summary(path: Path, content: dict) -> None:
    print(json.dumps(content), file=sys.stderr)
    with whole_file(path) as partial:
        partial.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")
