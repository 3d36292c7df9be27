"""Policies of recovery from failed registrations, in a closed loop on tables of a virtual camera (Table VIII)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.errors import InputError, require_names, with_key
from gpca.experiments.experiment import Experiment, LeftOut, Names, Tidy
from gpca.experiments.recovery.settings import RecoverySettings
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.frames.situations import SituationSettings
from gpca.objects.entry import dataset_of, title_of
from gpca.recovery.actions import ACTIONS, action_of
from gpca.recovery.policies import named_policies, policies, policy_entry
from gpca.recovery.policy import Thresholds

DECLARED = ("uncertain", "dominant", "improvement")  # thresholds that are given; null leaves one to the calibration


def check(config: dict, left_out: LeftOut) -> None:
    """Check the actions, the concepts that they treat, the policies, thresholds and ranges."""
    section = config["recovery"]
    require_names("recovery.objects", [section["objects"]], config["sources"], "source", left_out("sources"))
    for name, settings in section["actions"].items():
        with_key(f"recovery.actions.{name}", action_of, name, settings or {})
    require_names("recovery.costs", list(section["costs"]), ACTIONS, "action")
    for action in section["actions"]:
        if action not in section["costs"]:
            raise InputError("config key recovery.costs", f"lacks the action '{action}'", "give every action a cost")
    for concept, action in section["treatments"].items():
        key = f"recovery.treatments.{concept}"
        require_names(key, [action], section["actions"], "action", left_out("recovery.actions"))
    if len(set(section["treatments"].values())) < len(section["treatments"]):
        fault = "one action treats two concepts"
        raise InputError("config key recovery.treatments", fault, "give each concept its own")
    for name in section["policies"]:
        _check_policy(name, config, left_out)
    thresholds = {name: section["thresholds"][name] for name in DECLARED}
    thresholds = {name: value for name, value in thresholds.items() if value is not None}
    with_key("recovery.thresholds", lambda: Thresholds(**thresholds))
    ranges: dict[str, Any] = {name: tuple(section[name]) for name in ("noise_scale", "hidden")}
    with_key("recovery", lambda: SituationSettings(**ranges))


def _check_policy(name: str, config: dict, left_out: LeftOut) -> None:
    explainer = with_key("recovery.policies", policy_entry, name, tuple(config["recovery"]["actions"])).explainer
    if not explainer:
        return
    with_key(f"explainers.{explainer}", require_settings, explainer, config["explainers"].get(explainer) or {})
    if design := explainer_entry(explainer).design:
        key = f"recovery.policies.{name}"
        require_names(key, [design], config["uncertainty"], "uncertainty", left_out("uncertainty"))


def policies_without(left_out: LeftOut) -> set[str]:
    """Return the policies that go with the actions and the uncertainty that the config leaves out."""
    designs = left_out("uncertainty")
    reading = {name: entry.explainer for name, entry in named_policies().items() if entry.explainer}
    actions = [action for action in ACTIONS if action not in left_out("recovery.actions")]
    return {
        *(policies(tuple(ACTIONS)).keys() - policies(actions).keys()),
        *(name for name, explainer in reading.items() if explainer_entry(explainer).design in designs),
    }


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the policies that learn, from rehearsals or from a person's labels."""
    recovery = config["recovery"]
    entries = {name: policy_entry(name, tuple(recovery["actions"])) for name in recovery["policies"]}
    return {"learning_policy": [name for name, entry in entries.items() if entry.learns or entry.queues]}


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return titles of policies and objects, treatments, the budget of actions and the cost of a needless one."""
    recovery = config["recovery"]
    objects = sources[recovery["objects"]]
    return {
        "policies": {name: policy_entry(name, tuple(recovery["actions"])).title for name in recovery["policies"]},
        "recovery_title": f"Tables of the virtual camera, {title_of(objects)}",
        "recovery_dataset": dataset_of(objects),
        "treatments": recovery["treatments"],
        "policy_thresholds": recovery["thresholds"],
        "budget": recovery["loop"]["budget"],
        "needless": recovery["needless"],
    }


EXPERIMENT = Experiment(
    name="recovery",
    sections={"recovery": RecoverySettings},
    tidy=(
        Tidy(
            "recovery.csv",
            "gpca.experiments.recovery.metrics:collect_recovery",
            {"files": "recovery/seed{seed}.csv"},
            {
                "treatments": "recovery.treatments",
                "costs": "recovery.costs",
                "budget": "recovery.loop.budget",
                "curve": "success.curve",
            },
        ),
        Tidy(
            "recovery_intervals.csv",
            "gpca.experiments.recovery.intervals:collect_intervals",
            {"files": "recovery/seed{seed}.csv"},
            {"budget": "recovery.loop.budget"},
        ),
        Tidy(
            "recovery_differences.csv",
            "gpca.experiments.recovery.differences:collect_differences",
            {"files": "recovery/seed{seed}.csv"},
            {"actions": "recovery.actions", "budget": "recovery.loop.budget"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    leavable={"recovery.actions": Names("action", lambda: ACTIONS)},
    switches={"recovery.policies": Names("policy", lambda: policies(tuple(ACTIONS)))},
    lists={"recovery.policies": policies_without},
)
