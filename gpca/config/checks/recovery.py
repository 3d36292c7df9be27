"""Checks of the section ``recovery``: actions, the concepts that they treat, policies, thresholds, ranges."""

from __future__ import annotations

from collections.abc import Set
from typing import Any

from baselines.registry import explainer_entry, require_settings
from gpca.errors import InputError, require_names, with_key
from gpca.frames.situations import SituationSettings
from gpca.recovery.actions import ACTIONS, action_of
from gpca.recovery.policies import policy_entry
from gpca.recovery.policy import Thresholds

DECLARED = ("uncertain", "dominant", "improvement")  # thresholds that are given; null leaves one to the calibration


def check_recovery(
    config: dict, actions_left_out: Set[str], designs_left_out: Set[str], sources_left_out: Set[str]
) -> None:
    """Check the section against what exists."""
    section = config["recovery"]
    require_names("recovery.objects", [section["objects"]], config["sources"], "source", sources_left_out)
    for name, settings in section["actions"].items():
        with_key(f"recovery.actions.{name}", action_of, name, settings or {})
    require_names("recovery.costs", list(section["costs"]), ACTIONS, "action")
    for action in section["actions"]:
        if action not in section["costs"]:
            raise InputError("config key recovery.costs", f"lacks the action '{action}'", "give every action a cost")
    for concept, action in section["treatments"].items():
        key = f"recovery.treatments.{concept}"
        require_names(key, [action], section["actions"], "action", actions_left_out)
    if len(set(section["treatments"].values())) < len(section["treatments"]):
        raise InputError(
            "config key recovery.treatments", "one action treats two concepts", "give each concept its own"
        )
    for name in section["policies"]:
        _check_policy(name, config, designs_left_out)
    declared = {name: section["thresholds"][name] for name in DECLARED}
    declared = {name: value for name, value in declared.items() if value is not None}
    with_key("recovery.thresholds", lambda: Thresholds(**declared))
    ranges: dict[str, Any] = {name: tuple(section[name]) for name in ("noise_scale", "hidden")}
    with_key("recovery", lambda: SituationSettings(**ranges))


def _check_policy(name: str, config: dict, designs_left_out: Set[str]) -> None:
    explainer = with_key("recovery.policies", policy_entry, name, tuple(config["recovery"]["actions"])).explainer
    if not explainer:
        return
    with_key(f"explainers.{explainer}", require_settings, explainer, config["explainers"].get(explainer) or {})
    if design := explainer_entry(explainer).design:
        key = f"recovery.policies.{name}"
        require_names(key, [design], config["uncertainty"], "uncertainty", designs_left_out)
