"""The model file, which contains tensors, numbers and names only, so that loading it executes no code.

A model may come from anywhere, so its contents are checked when it is loaded.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

import torch
from torch import nn

from gpca.alignment.icp import ICPSettings
from gpca.causes.descriptors import WIDTHS
from gpca.causes.policy import NOTHING, QUEUE, RecoveryPolicy, Thresholds
from gpca.causes.settings import Moved
from gpca.causes.truth import FAILED, NOMINAL
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.classifier.sparse_gp import make_covariance
from gpca.encoders.registry import EncoderSettings, make_encoder
from gpca.encoders.tensor_file import read_tensors, require_like, write_tensors
from gpca.errors import InputError
from gpca.evaluation.conformal import Nonconformity
from gpca.explainers.classifiers import require_trees
from gpca.explainers.pair_classifier import ABSENT, PRESENT
from gpca.guarantee.guarantee import STATES, Guarantee
from gpca.model.clouds import MEASURES, Familiarity
from gpca.model.diagnoser import READS, Diagnoser
from gpca.model.location import REMEDY, require_model
from gpca.objects.canonical import FEWEST_CLOUD_POINTS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import DESCRIBED, FEATURES
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings
from gpca.uncertainty.settings import FEWEST_STARTS, UncertaintySettings

FORMAT, VERSION = "GP-CA model", 4
FEATURE_COUNT = len(FEATURES) + sum(WIDTHS[group] for group in DESCRIBED)  # of a diagnoser
ASYMMETRY = 1e-9  # of a covariance, whose prior is the identity
# Upper bounds on the work of one explanation. A score is a mean over the draws of the classifier, so that a million
# draws leave an error of at most 0.0005.
MOST_DRAWS = 10**6
MOST_ENCODED_POINTS = 10**6  # in all draws of the encoder together
MOST_CLOUD_POINTS = 10**6
MOST_ITERATIONS = 10**5  # of ICP
MOST_RUNS = 10**4  # of ICP, for the features of a pair
MOST_NEIGHBORS = 10**4  # and other counts among a backbone's options


@dataclass(frozen=True)
class Model:
    """A diagnoser of registrations and the paper's GP-CA."""

    diagnoser: Diagnoser  # reads the pair after ICP, trained on measured causes of all sources
    encoder: nn.Module  # maps clouds (B, N, 3) to embeddings (B, d); in evaluation mode
    encoder_settings: EncoderSettings  # number of points per draw and of draws per embedding, among others
    gpc: GPC  # the classifier; its classes are the concepts
    icp: ICPSettings  # settings of ICP
    cloud_points: int  # maximum number of points of source and target
    policy: RecoveryPolicy  # maps causes to actions
    title: str  # training objects of GP-CA
    stand_in: bool  # whether the package generated these
    familiar: Familiarity  # ranges of simple measures over GP-CA's training clouds
    learned_from: tuple[str, ...] = ()  # titles of the training objects of the diagnosis; empty if unknown

    @property
    def learning(self) -> str:
        """The training data, in words."""
        paper = f"{self.title} (procedural stand-in)" if self.stand_in else self.title
        objects = ", ".join(self.learned_from) or "objects that the model file does not name"
        return f"the diagnosis learned from {objects}; GP-CA as in the paper from {paper}"

    def save(self, path: str | Path) -> None:
        """Write the file; equal models give equal bytes."""
        settings = {name: value for name, value in asdict(self.encoder_settings).items() if value is not None}
        content = {
            "format": FORMAT,
            "version": VERSION,
            "diagnoser": self.diagnoser.state(),
            "encoder": self.encoder.state_dict(),
            "encoder_settings": {"points" if key == "draw_points" else key: value for key, value in settings.items()},
            "gpc": self.gpc.state(),
            "icp": asdict(self.icp),
            "points": self.cloud_points,
            "thresholds": asdict(self.policy.thresholds),
            "treatments": dict(self.policy.treatments),
            "title": self.title,
            "stand_in": self.stand_in,
            "familiar": {name: list(ends) for name, ends in self.familiar.ranges.items()},
        }
        if self.learned_from:
            content["learned_from"] = list(self.learned_from)
        write_tensors(path, content)

    @classmethod
    def load(cls, path: str | Path) -> Model:
        """Read the file."""
        require_model(path)
        try:
            content = read_tensors(path)
        except Exception as fault:  # torch raises errors of many kinds for a damaged or foreign file
            why = f" ({fault})" if isinstance(fault, ValueError) else ""
            raise InputError(path, f"is damaged or not a model{why}", REMEDY) from fault
        if not isinstance(content, Mapping) or content.get("format") != FORMAT:
            raise InputError(path, "is not a model", REMEDY)
        if (version := content.get("version")) != VERSION:
            raise InputError(path, f"is a model of version {version}, not {VERSION}", REMEDY)
        try:
            encoder_settings = dict(content["encoder_settings"])
            settings = EncoderSettings(draw_points=encoder_settings.pop("points"), **encoder_settings)
            _require_possible(content, settings)
            encoder = make_encoder(settings.backbone, settings.options)
            encoder.load_state_dict(content["encoder"])
            return cls(
                diagnoser=Diagnoser.from_state(content["diagnoser"]),
                encoder=encoder.eval(),
                encoder_settings=settings,
                gpc=GPC.from_state(content["gpc"]),
                icp=ICPSettings(**content["icp"]),
                cloud_points=content["points"],
                policy=RecoveryPolicy(Thresholds(**content["thresholds"]), dict(content["treatments"])),
                title=content["title"],
                stand_in=content["stand_in"],
                familiar=Familiarity({name: (low, high) for name, (low, high) in content["familiar"].items()}),
                learned_from=tuple(content.get("learned_from", ())),
            )
        except (LookupError, TypeError, ValueError, RuntimeError, AttributeError) as fault:
            raise InputError(path, f"is a model with missing or damaged parts ({fault})", REMEDY) from fault


def _require_possible(content: Mapping, settings: EncoderSettings) -> None:
    """Raise a ValueError that names any impossible content of a model file with these encoder settings."""
    read_settings(EncoderSettings, vars(settings))
    read_settings(GPCSettings, content["gpc"]["settings"])
    read_settings(ICPSettings, content["icp"])
    if set(ranges := content["familiar"]) != set(MEASURES):
        raise ValueError(f"ranges of {', '.join(map(repr, ranges))}, not {', '.join(MEASURES)}")
    for name, (low, high) in ranges.items():
        if not (type(low) is type(high) is float and 0 <= low <= high):
            raise ValueError(f"range of {name}: {low!r} to {high!r} is not a range")
    _require_diagnoser(content["diagnoser"])
    counts = {
        "draws of the classifier": (content["gpc"]["settings"]["draws"], 2, MOST_DRAWS),
        "points": (content["points"], FEWEST_CLOUD_POINTS, MOST_CLOUD_POINTS),
        "iterations of ICP": (content["icp"]["max_iterations"], 1, MOST_ITERATIONS),
        "draws of the encoder": (settings.draws, 1, MOST_ENCODED_POINTS // settings.draw_points),
        "attempts": (content["thresholds"]["attempts"], 1, MOST_ITERATIONS),
    }
    _require_counts(counts)
    for name, value in settings.options.items():  # a user's backbone has options of its own
        if isinstance(value, int | float) and not 0 <= value <= MOST_NEIGHBORS:
            raise ValueError(f"option {name}: {value!r} is not from 0 to {MOST_NEIGHBORS}")
    if not isinstance(content["title"], str) or not content["title"].isprintable():
        raise ValueError("its title is not a line of text")
    titles = content.get("learned_from", [])
    if not isinstance(titles, list) or not all(isinstance(title, str) and title.isprintable() for title in titles):
        raise ValueError("learned_from is not a list of lines of text")
    if set(treatments := content["treatments"]) != set(CONCEPTS):
        raise ValueError(f"treatments: of {str([*treatments])[:80]}, not of {', '.join(CONCEPTS)}")
    for action in treatments.values():  # of any robot: other actions than the paper's are allowed
        is_name = isinstance(action, str) and re.fullmatch(r"[a-z][a-z0-9_]{0,39}", action)
        if not is_name or action in (NOTHING, QUEUE):
            raise ValueError(f"treatments: {str(action)[:40]!r} is no name of an action")
    if len(set(treatments.values())) < len(treatments):
        raise ValueError("treatments: one action treats two concepts")
    if type(content["stand_in"]) is not bool:
        raise ValueError("stand_in is neither true nor false")
    with torch.device("meta"):  # the options may ask for more than the memory
        encoder = make_encoder(settings.backbone, settings.options)
    require_like(content["encoder"], encoder.state_dict(), "encoder")
    _require_classifier(content["gpc"], CONCEPTS, encoder.embedding_size)


def _require_counts(counts: Mapping[str, tuple[object, int, int]]) -> None:
    for name, (count, least, most) in counts.items():
        if type(count) is not int or not least <= count <= most:
            raise ValueError(f"{name}: {count!r} is not a number from {least} to {most}")


def _require_diagnoser(state: Mapping) -> None:
    read_settings(UncertaintySettings, state["runs"])
    read_settings(ICPSettings, state["icp"])
    settings = read_settings(ReenactmentSettings, state["reenactment"])
    for name, allowed in (("reads", (READS,)), ("moved", get_args(Moved))):
        if state[name] not in allowed:
            raise ValueError(f"{name}: {str(state[name])[:40]!r} is not one of {', '.join(allowed)}")
    classifier, starts = state["classifier"], state["runs"]["starts"]
    counts = {
        "points of a description": (state["points"], FEWEST_CLOUD_POINTS, MOST_CLOUD_POINTS),
        "starts": (starts, FEWEST_STARTS, MOST_RUNS),
        "iterations of ICP": (state["icp"]["max_iterations"], 1, MOST_ITERATIONS),
        "classifiers of causes": (len(classifier["causes"]), len(CONCEPTS), len(CONCEPTS)),
        "re-enactments": (settings.calls(starts), 1, MOST_RUNS),
    }
    _require_counts(counts)
    quantiles, weights, threshold = classifier["quantiles"], state["error_weights"], state["threshold"]
    if quantiles.ndim != 2 or len(quantiles) < 2 or quantiles.shape[1] != FEATURE_COUNT:
        raise ValueError(f"'quantiles' has shape {tuple(quantiles.shape)}, not {FEATURE_COUNT} descriptors")
    if (quantiles.diff(dim=0) < 0).any():
        raise ValueError("'quantiles' decrease")
    if tuple(weights.shape) != (FEATURE_COUNT + 1,):
        raise ValueError(f"'error_weights' has shape {tuple(weights.shape)}, not {(FEATURE_COUNT + 1,)}")
    if type(threshold) is not float or not 0 <= threshold <= 2:
        raise ValueError(f"threshold: {threshold!r} is not a probability")
    causes = [(cause, (ABSENT, PRESENT)) for cause in classifier["causes"]]
    for gpc, classes in [(classifier["failure"], (NOMINAL, FAILED)), *causes]:
        _require_counts({"draws of a classifier": (gpc["settings"]["draws"], 2, MOST_DRAWS)})
        read_settings(GPCSettings, gpc["settings"])
        _require_classifier(gpc, classes, FEATURE_COUNT)
    _require_counts({"questions of trees": (len(classifier["trees"]), 1 + len(CONCEPTS), 1 + len(CONCEPTS))})
    for question in classifier["trees"]:
        require_trees(question, FEATURE_COUNT)
    sets = Guarantee.from_dict(state["guarantee"]).state_sets
    if sets.states != STATES or not 0 < sets.level < 1 or sets.nonconformity not in get_args(Nonconformity):
        raise ValueError("its guarantee is of different states, or of none")
    for name, value in state["held_out"].items():
        if type(name) is not str or not name.isidentifier() or type(value) is not float or not 0 <= value < MOST_DRAWS:
            raise ValueError(f"held_out: {str(name)[:40]!r} is not the name of a measure with a value")


def _require_classifier(state: Mapping, classes: tuple[str, ...], d: int) -> None:
    if tuple(state["classes"]) != classes:  # their order is that of the scores
        raise ValueError(f"its classes are {str(state['classes'])[:80]}, not {', '.join(classes)}")
    n_classes, m, n = len(classes), len(state["inducing"]), len(state["labelled"])
    shapes = {"scaler_mean": (d,), "scaler_scale": (d,), "inducing": (m, d), "labelled": (n, d), "targets": (n,)}
    shapes |= {"mean": (n_classes, m), "covariance": (n_classes, m, m)}
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
