"""The choices that touch several of the paper's tables, the parts of the tables that each touches, and their names.

A *joint reading* has a value of every choice. A printed number depends on some choices alone, those of its *part*, so
that a grid of joint readings takes far fewer values than it has readings. Nothing here needs torch.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from gpca.settings import Distinct, Keys, OpenShare

SEVERITIES = "severities"
PROTOCOL = "protocol"  # the severities of the protocol
# Severities of training and test samples; of the classifier, the scale of its inputs, where inducing inputs and
# lengthscale start, the samples of an iteration, kernel and schedule; the share of the new concept in the pool; how far
# SHAP and SA turn the knobs; the samples and the distance of ρ, and these samples of AUC and ECE.
CHOICES: Mapping[str, Any] = {
    SEVERITIES: Literal["protocol", "weaker", "stronger"],
    "inputs": Literal["standardised", "unit_norm", "raw"],
    "inducing": Literal["kmeans", "random"],
    "lengthscale": Literal["median", "default"],
    "batch": Literal["full", "minibatch"],
    "kernel": Literal["rbf", "matern32"],
    "new_share": OpenShare,
    "knobs": Literal["middle", "low", "high"],
    "set": Literal["in_distribution", "severity", "in_distribution+severity"],
    "distance": Literal["knn_analytical", "mahalanobis_analytical", "knn_embedding", "mahalanobis_embedding"],
}
Grid = Annotated[dict, Keys({name: Distinct[kind] for name, kind in CHOICES.items()}, required=CHOICES)]  # type: ignore[valid-type]
START = ("inputs", "inducing", "lengthscale", "batch")
PARTS = {  # part -> the choices that its numbers depend on
    "knobs": (SEVERITIES, "knobs"),  # Table I, SHAP and SA
    "schedules": (SEVERITIES, *START),  # Table IV
    "classifier": (SEVERITIES, *START, "kernel"),  # GP-CA of Tables I and II, accuracies of the GPC in V
    "labels": (SEVERITIES, *START, "kernel", "new_share"),  # Table III
    "learners": (SEVERITIES, "inputs"),  # accuracies of forest and SVM in Table V
    "diagnostics": (SEVERITIES, *START, "kernel", "set", "distance"),  # of the GPC in Table V
    "learner_diagnostics": (SEVERITIES, "inputs", "set", "distance"),  # of forest and SVM
}
SCHEDULES = {"rbf": ("rbf", 0.01, 100), "matern32": ("matern32", 0.01, 200)}  # of a kernel in all tables but IV
Joint = dict[str, Any]  # a value of every choice


def part_name(part: str, joint: Joint) -> str:
    """Return the name of a part under a joint reading, as `table` of its tidy rows has it: ``knobs/weaker/low``."""
    return "/".join([part, *(text_of(joint[choice]) for choice in PARTS[part])])


def text_of(value: Any) -> str:
    """Return a value of a choice as names and files have it."""
    return f"{value:g}" if isinstance(value, float) else str(value)
