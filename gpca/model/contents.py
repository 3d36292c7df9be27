"""Checks of a model file: settings within their bounds, and numbers that fit together.

A model may come from anywhere. Its faults have to be found when it is loaded, not when it hangs or explains.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import get_args

import torch

from gpca.alignment.icp import ICPSettings
from gpca.causes.settings import Moved
from gpca.causes.truth import FAILED, NOMINAL
from gpca.classifier.covariances import make_covariance
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.encoders.tensor_file import require_like
from gpca.explainers.boosted_trees import require_trees
from gpca.explainers.pair_classifier import ABSENT, PRESENT
from gpca.features.dataset import WIDTHS
from gpca.features.settings import DescriptorSettings
from gpca.guarantee.guarantee import Guarantee
from gpca.guarantee.sets import Nonconformity
from gpca.guarantee.states import STATES
from gpca.model.diagnoser import REENACTED, REMEDIED
from gpca.model.familiarity import MEASURES
from gpca.objects.canonical import FEWEST_CLOUD_POINTS
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.policy import TREATMENTS
from gpca.reenactment.dataset import DESCRIBED
from gpca.reenactment.features import FEATURES
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings
from gpca.uncertainty.settings import FEWEST_STARTS, UncertaintySettings

# The most that one explanation can be asked for: above it takes minutes, or all memory, and gains nothing. A score is
# the mean over the draws of the classifier, so a million of them leave an error of 0.0005 at most.
MOST_DRAWS = 10**6
MOST_ENCODED_POINTS = 10**6  # in all draws of the encoder together
MOST_CLOUD_POINTS = 10**6
MOST_ITERATIONS = 10**5  # of ICP
MOST_RUNS = 10**4  # of ICP, to describe a pair
MOST_NEIGHBORS = 10**4  # or whatever else a backbone's options count
WIDTH_READ = {
    REENACTED: len(FEATURES) + sum(WIDTHS[group] for group in DESCRIBED),
    REMEDIED: sum(WIDTHS.values()),
}
ASYMMETRY = 1e-9  # of a covariance, whose prior is the identity


def require_possible(content: Mapping, settings: EncoderSettings) -> None:
    """Raise a ValueError that names any impossible content of a model file whose encoder has these settings."""
    read_settings(EncoderSettings, vars(settings))
    read_settings(GPCSettings, content["gpc"]["settings"])
    read_settings(ICPSettings, content["icp"])
    if "familiar" in content:
        _require_ranges(content["familiar"])
    if content["diagnoser"] is not None:
        _require_diagnoser(content["diagnoser"])
    counts = {
        "draws of the classifier": (content["gpc"]["settings"]["draws"], 2, MOST_DRAWS),
        "points": (content["points"], FEWEST_CLOUD_POINTS, MOST_CLOUD_POINTS),
        "iterations of ICP": (content["icp"]["max_iterations"], 1, MOST_ITERATIONS),
        "draws of the encoder": (settings.draws, 1, MOST_ENCODED_POINTS // settings.draw_points),
        "attempts": (content["thresholds"]["attempts"], 1, MOST_ITERATIONS),
    }
    _require_counts(counts)
    for name, value in settings.options.items():  # a backbone of a user's own has options of its own
        if isinstance(value, int | float) and not 0 <= value <= MOST_NEIGHBORS:
            raise ValueError(f"option {name}: {value!r} is not from 0 to {MOST_NEIGHBORS}")
    if not isinstance(content["title"], str) or not content["title"].isprintable():
        raise ValueError("its title is not a line of text")
    titles = content.get("learned_from", [])
    if not isinstance(titles, list) or not all(isinstance(title, str) and title.isprintable() for title in titles):
        raise ValueError("learned_from is not a list of lines of text")
    _require_treatments(content["treatments"])
    if type(content["stand_in"]) is not bool:
        raise ValueError("stand_in is neither true nor false")
    with torch.device("meta"):  # what the options ask for may not fit into the memory
        encoder = make_encoder(settings.backbone, settings.options)
    require_like(content["encoder"], encoder.state_dict(), "encoder")
    _require_classifier(content["gpc"], CONCEPTS, encoder.embedding_size)


def _require_counts(counts: Mapping[str, tuple[object, int, int]]) -> None:
    for name, (count, least, most) in counts.items():
        if type(count) is not int or not least <= count <= most:
            raise ValueError(f"{name}: {count!r} is not a number from {least} to {most}")


def _require_treatments(treatments: Mapping) -> None:
    if set(treatments) != set(CONCEPTS):
        raise ValueError(f"treatments: of {str([*treatments])[:80]}, not of {', '.join(CONCEPTS)}")
    for action in treatments.values():
        if action not in (actions := _known_actions([*treatments.values()])):
            raise ValueError(f"treatments: {str(action)[:40]!r} is not one of {', '.join(actions)}")
    if len(set(treatments.values())) < len(treatments):
        raise ValueError("treatments: one action treats two concepts")


def _known_actions(named: list[str]) -> Collection[str]:
    """Return the actions that there are; those of the paper need no robot's code to be loaded."""
    if set(named) <= set(TREATMENTS.values()):
        return TREATMENTS.values()
    from gpca.recovery.actions import ACTIONS

    return ACTIONS


def _require_ranges(ranges: Mapping) -> None:
    if set(ranges) != set(MEASURES):
        raise ValueError(f"ranges of {', '.join(map(repr, ranges))}, not {', '.join(MEASURES)}")
    for name, (low, high) in ranges.items():
        if not (type(low) is type(high) is float and 0 <= low <= high):
            raise ValueError(f"range of {name}: {low!r} to {high!r} is not a range")


def _require_diagnoser(state: Mapping) -> None:
    read_settings(UncertaintySettings, state["runs"])
    read_settings(ICPSettings, state["icp"])
    classifier = state["classifier"]
    counts = {
        "points of a description": (state["points"], FEWEST_CLOUD_POINTS, MOST_CLOUD_POINTS),
        "starts": (state["runs"]["starts"], FEWEST_STARTS, MOST_RUNS),
        "iterations of ICP": (state["icp"]["max_iterations"], 1, MOST_ITERATIONS),
        "classifiers of causes": (len(classifier["causes"]), len(CONCEPTS), len(CONCEPTS)),
    }
    _require_counts(counts | _counts_of_runs(state))
    features = WIDTH_READ[state.get("reads", REMEDIED)]
    quantiles, weights, threshold = classifier["quantiles"], state["error_weights"], state["threshold"]
    if quantiles.ndim != 2 or len(quantiles) < 2 or quantiles.shape[1] != features:
        raise ValueError(f"'quantiles' has shape {tuple(quantiles.shape)}, not {features} descriptors")
    if (quantiles.diff(dim=0) < 0).any():
        raise ValueError("'quantiles' decrease")
    if tuple(weights.shape) != (features + 1,):
        raise ValueError(f"'error_weights' has shape {tuple(weights.shape)}, not {(features + 1,)}")
    if type(threshold) is not float or not 0 <= threshold <= 2:
        raise ValueError(f"threshold: {threshold!r} is not a probability")
    for gpc, classes in [
        (classifier["failure"], (NOMINAL, FAILED)),
        *((cause, (ABSENT, PRESENT)) for cause in classifier["causes"]),
    ]:
        _require_counts({"draws of a classifier": (gpc["settings"]["draws"], 2, MOST_DRAWS)})
        read_settings(GPCSettings, gpc["settings"])
        _require_classifier(gpc, classes, features)
    if trees := classifier.get("trees"):
        _require_counts({"questions of trees": (len(trees), 1 + len(CONCEPTS), 1 + len(CONCEPTS))})
        for question in trees:
            require_trees(question, features)
    _require_promises(state)


def _counts_of_runs(state: Mapping) -> dict[str, tuple[object, int, int]]:
    """Return the numbers of registrations that a diagnosis makes again, and check their settings."""
    if state.get("reads", REMEDIED) == REENACTED:
        settings = read_settings(ReenactmentSettings, state["reenactment"])
        if state["moved"] not in get_args(Moved):
            raise ValueError(f"moved: {str(state['moved'])[:40]!r} is not one of {', '.join(get_args(Moved))}")
        return {"re-enactments": (settings.calls(state["runs"]["starts"]), 1, MOST_RUNS)}
    remedies = read_settings(DescriptorSettings, state["descriptors"])
    return {"starts with remedies": (remedies.starts, 1, MOST_RUNS), "restarts": (remedies.restarts, 1, MOST_RUNS)}


def _require_promises(state: Mapping) -> None:
    if state.get("guarantee") is not None:
        sets = Guarantee.from_dict(state["guarantee"]).state_sets
        if sets.states != STATES or not 0 < sets.level < 1 or sets.nonconformity not in get_args(Nonconformity):
            raise ValueError("its guarantee is of different states, or of none")
    for name, value in state.get("held_out", {}).items():
        if type(name) is not str or not name.isidentifier() or type(value) is not float or not 0 <= value < MOST_DRAWS:
            raise ValueError(f"held_out: {str(name)[:40]!r} is not the name of a measure with a value")


def _require_classifier(state: Mapping, classes: tuple[str, ...], d: int) -> None:
    if tuple(state["classes"]) != classes:  # their order is that of the scores
        raise ValueError(f"its classes are {str(state['classes'])[:80]}, not {', '.join(classes)}")
    n_classes = len(classes)
    m, n = len(state["inducing"]), len(state["labelled"])
    shapes = {
        "scaler_mean": (d,),
        "scaler_scale": (d,),
        "inducing": (m, d),
        "mean": (n_classes, m),
        "covariance": (n_classes, m, m),
        "labelled": (n, d),
        "targets": (n,),
    }
    for name, shape in shapes.items():
        if tuple(state[name].shape) != shape:
            raise ValueError(f"'{name}' has shape {tuple(state[name].shape)}, not {shape}")
        if name != "targets" and not state[name].is_floating_point():
            raise ValueError(f"'{name}' does not hold real numbers")
    if not all(isinstance(axis, str | int) for axis in state["axes"]) or isinstance(state["axes"], str):
        raise ValueError("the names of its seed are neither texts nor numbers")
    kernel = make_covariance(state["settings"]["kernel"], n_classes, lengthscale=1.0).state_dict()
    require_like(state["kernel"], kernel, "kernel")
    if not all(torch.equal(state["kernel"][name], kernel[name]) for name in kernel if name.endswith("_bound")):
        raise ValueError("its kernel has different bounds")
    if not (state["scaler_scale"] > 0).all():
        raise ValueError("'scaler_scale' contains values that are not above 0")
    covariance = state["covariance"].double()
    # Cholesky reads one triangle alone.
    if (covariance - covariance.mT).abs().max() > ASYMMETRY or torch.linalg.cholesky_ex(covariance).info.any():
        raise ValueError("'covariance' is not symmetric and positive definite")
    if state["targets"].is_floating_point() or not ((state["targets"] >= 0) & (state["targets"] < n_classes)).all():
        raise ValueError("'targets' names a missing concept")
