"""Step ``recover``: settings -> failures on virtual scenes, and what every policy of recovery makes of them."""

from __future__ import annotations

import json
import sys
from argparse import ArgumentParser, Namespace
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import torch

from gpca.encoders.settings import EncoderSettings
from gpca.errors import InputError
from gpca.files import whole_file, write_csv
from gpca.frames.camera import Camera
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.rgbd_scene import SceneSettings
from gpca.frames.situations import Shelf, Situations, SituationSettings
from gpca.objects import procedural
from gpca.pairs.synthesis import RegistrationSettings
from gpca.provenance import record_provenance
from gpca.recovery.actions import action_of
from gpca.recovery.example import save_example
from gpca.recovery.loop import Loop, LoopSettings, find_failures, register_situations
from gpca.recovery.loop_explainers import LoopExplainers, learn_explainers
from gpca.recovery.policies import policy_entry
from gpca.recovery.policy import RecoveryPolicy
from gpca.settings import check_settings
from gpca.uncertainty.settings import UncertaintySettings

SOURCE = "recovery"  # names every random number of this step, tables included
FEWEST_FAILED = 10  # calibration samples, for a threshold to be chosen on the failed ones alone
SECTIONS = {
    "recovery": ("recovery",),
    "scenes": ("real_world", "scenes"),
    "registrations": ("registrations",),
    "encoder": ("encoders", "*"),
    "uncertainty": ("uncertainty", "*"),
}


def add_arguments(parser: ArgumentParser) -> None:
    """Declare files; ``--settings`` holds the sections of the config that are read."""
    parser.add_argument("--seed", required=True, type=int)
    parser.add_argument("--out", required=True, type=Path, help="CSV: a row per failure, policy and step")
    parser.add_argument("--timings", required=True, type=Path, help="CSV of their seconds")
    parser.add_argument("--policy", required=True, type=Path, help="JSON of the thresholds chosen")
    parser.add_argument("--example", required=True, type=Path, help="npz of one failure, for the figure")


def run(options: Namespace) -> None:
    """Learn the classifier, find failures and let every policy act on them."""
    torch.set_num_threads(options.threads)
    given = options.settings
    _check(given)
    recovery, policies = given["recovery"], given["recovery"]["policies"]
    actions = {name: action_of(name, settings or {}) for name, settings in recovery["actions"].items()}
    entries = {name: policy_entry(name, tuple(actions)) for name in policies}
    registration = RegistrationSettings.from_dict(given["registrations"])
    situation = situation_settings(given, registration)
    loop = LoopSettings(**recovery["loop"], cloud_points=registration.cloud_points, icp=registration.icp)
    outputs = [options.out, options.timings, options.policy, options.example]
    axes = (SOURCE, options.seed)
    with record_provenance(outputs, [], given, seed=options.seed):
        surfaces = [surface for family in situation.scenes.families for surface in procedural.surfaces(family)]
        shelf = Shelf(surfaces, SOURCE, recovery["model_points"], InitialPoseSettings(**recovery["estimator"]))
        tables = {part: Situations(shelf, situation, (*axes, part)) for part in ("train", "test", "failures")}
        registrations, failed_S = register_situations(tables, recovery["train"], recovery["calibration"], loop)
        explainers = learn_explainers(
            [name for name in dict.fromkeys(entry.explainer for entry in entries.values()) if name],
            registrations,
            EncoderSettings(**given["encoder"]),
            given.get("explainers", {}),
            UncertaintySettings(**given["uncertainty"], icp=registration.icp),
            recovery["remedied"],
            *axes,
        )
        policy = robot_policy(recovery, explainers, failed_S[registrations.rows("test")])
        _write_policy(options.policy, policy, explainers)
        episodes = find_failures(tables["failures"], loop)
        rows, seconds = Loop(episodes, actions, explainers.explain, policy, loop, axes).run(policies)
        write_csv(options.out, rows)
        write_csv(options.timings, seconds)
        save_example(options.example, episodes, rows, actions, loop)


def situation_settings(given: dict, registration: RegistrationSettings) -> SituationSettings:
    """Build from the sections ``real_world.scenes`` and ``recovery`` of the config."""
    recovery = given["recovery"]
    scenes = replace(
        SceneSettings.from_dict(given["scenes"]), count=recovery["tables"], camera=Camera(**recovery["camera"])
    )
    ranges = {name: tuple(recovery[name]) for name in ("noise_scale", "hidden")}
    return SituationSettings(scenes, **ranges, severities=registration.severities)


def robot_policy(recovery: dict, explainers: LoopExplainers, failed_N: np.ndarray) -> RecoveryPolicy:
    """Return the declared thresholds, and the one that is chosen on the calibration samples unless it is declared.

    Chosen on those that failed (N,), since a policy is asked about such; on all where hardly any did.
    """
    gpca = explainers.calibration.get("gpca")
    bald_N = np.full(len(failed_N), np.inf) if gpca is None else gpca.bald_N
    rows = failed_N if failed_N.sum() >= FEWEST_FAILED else np.ones(len(failed_N), bool)
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N[rows])


def _check(given: dict) -> None:
    for part, section in SECTIONS.items():
        if part not in given:
            raise InputError("--settings", f"has no section '{part}'", "see workflow/rules/recovery.smk")
        check_settings(given[part], *section)


def _write_policy(path: Path, policy: RecoveryPolicy, explainers: LoopExplainers) -> None:
    accuracy = {name: round(float(explainers.right(name).mean()), 6) for name in explainers.calibration}
    thresholds = {name: round(value, 6) for name, value in asdict(policy.thresholds).items()}
    content = {
        "thresholds": thresholds,
        "treatments": dict(policy.treatments),
        "calibration_samples": len(explainers.concepts),
        "calibration_accuracy": accuracy,
    }
    print(json.dumps(content), file=sys.stderr)
    with whole_file(path) as partial:
        partial.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")
