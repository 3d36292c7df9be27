"""The model file: arrays, numbers and names only, checked when loaded, so that loading executes no code."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.policy import NOTHING, QUEUE, RecoveryPolicy, Thresholds
from gpca.causes.settings import Moved
from gpca.causes.truth import FAILED, NOMINAL
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.inference import TrainedEncoder
from gpca.encoders.registry import EncoderSettings
from gpca.errors import InputError
from gpca.explainers.classifiers import require_trees
from gpca.explainers.pair_classifier import ABSENT, PRESENT
from gpca.guarantee.guarantee import STATES, WHETHER_FAILED, Guarantee
from gpca.io.array_tree import TEXT, read_tree, write_tree
from gpca.model import torch_file
from gpca.model.clouds import MEASURES, Familiarity
from gpca.model.diagnoser import READS, Diagnoser, upgraded
from gpca.model.location import REMEDY, require_model
from gpca.model.result import ERROR, OF_TREES, PROBABILITY
from gpca.objects.canonical import FEWEST_CLOUD_POINTS
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import DESCRIPTORS, FEATURES
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings
from gpca.uncertainty.settings import FEWEST_STARTS, UncertaintySettings

FORMAT, VERSION = "GP-CA model", 6
FEATURE_COUNT = len(FEATURES) + DESCRIPTORS  # of a diagnoser
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
    encoder: TrainedEncoder  # maps clouds (B, N, 3) to embeddings (B, d)
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
        learned = f"the diagnosis learned from {objects}; GP-CA as in the paper from {paper}"
        by = [level.guarantee for level in self.diagnoser.levels if level.guarantee and level.guarantee.labeled]
        counts = " and ".join(dict.fromkeys(f"{guarantee.samples}" for guarantee in by))
        return f"{learned}; calibrated on {counts} labeled registrations" if by else learned

    def save(self, path: str | Path) -> None:
        """Write the file; equal models give equal bytes."""
        settings = {name: value for name, value in asdict(self.encoder.settings).items() if value is not None}
        content = {
            "format": FORMAT,
            "version": VERSION,
            "diagnoser": self.diagnoser.state(),
            "encoder": dict(self.encoder.weights),
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
        write_tree(path, content)

    @classmethod
    def load(cls, path: str | Path) -> Model:
        """Read the file."""
        require_model(path)
        try:
            with zipfile.ZipFile(path) as archive:
                is_tree = TEXT in archive.namelist()
            content = read_tree(path) if is_tree else torch_file.read_torch_file(path)
        except Exception as fault:  # pickle, zipfile and numpy raise errors of many kinds for a damaged or foreign file
            why = f" ({fault})" if isinstance(fault, ValueError) else ""
            raise InputError(path, f"is damaged or not a model{why}", REMEDY) from fault
        if not isinstance(content, Mapping) or content.get("format") != FORMAT:
            raise InputError(path, "is not a model", REMEDY)
        if (version := content.get("version")) not in (VERSION, VERSION - 1):
            raise InputError(path, f"is a model of version {version}, not {VERSION}", REMEDY)
        try:
            if version != VERSION:
                content = {**content, "diagnoser": upgraded(content["diagnoser"])}
            encoder_settings = dict(content["encoder_settings"])
            settings = EncoderSettings(draw_points=encoder_settings.pop("points"), **encoder_settings)
            encoder = TrainedEncoder(settings, content["encoder"])
            _require_possible(content, encoder)
            return cls(
                diagnoser=Diagnoser.from_state(content["diagnoser"]),
                encoder=encoder,
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


def _require(holds: object, fault: str) -> None:
    if not holds:
        raise ValueError(fault)


def _require_count(name: str, count: object, least: int, most: int) -> None:
    _require(type(count) is int and least <= count <= most, f"{name}: {count!r} is not a number from {least} to {most}")


def _require_possible(content: Mapping, encoder: TrainedEncoder) -> None:
    """Raise a ValueError that names any impossible content of a model file with this encoder."""
    settings = encoder.settings
    read_settings(EncoderSettings, vars(settings))
    read_settings(GPCSettings, content["gpc"]["settings"])
    read_settings(ICPSettings, content["icp"])
    ranges = content["familiar"]
    _require(set(ranges) == set(MEASURES), f"ranges of {', '.join(map(repr, ranges))}, not {', '.join(MEASURES)}")
    for name, (low, high) in ranges.items():
        is_range = type(low) is type(high) is float and 0 <= low <= high
        _require(is_range, f"range of {name}: {low!r} to {high!r} is not a range")
    _require_diagnoser(content["diagnoser"])
    _require_count("draws of the classifier", content["gpc"]["settings"]["draws"], 2, MOST_DRAWS)
    _require_count("points", content["points"], FEWEST_CLOUD_POINTS, MOST_CLOUD_POINTS)
    _require_count("iterations of ICP", content["icp"]["max_iterations"], 1, MOST_ITERATIONS)
    _require_count("draws of the encoder", settings.draws, 1, MOST_ENCODED_POINTS // settings.draw_points)
    _require_count("attempts", content["thresholds"]["attempts"], 1, MOST_ITERATIONS)
    for name, value in settings.options.items():  # a user's backbone may have further options
        within = not isinstance(value, int | float) or 0 <= value <= MOST_NEIGHBORS
        _require(within, f"option {name}: {value!r} is not from 0 to {MOST_NEIGHBORS}")
    _require(_is_line(content["title"]), "its title is not a line of text")
    titles = content.get("learned_from", [])
    _require(isinstance(titles, list) and all(map(_is_line, titles)), "learned_from is not a list of lines of text")
    treatments = content["treatments"]
    fault = f"treatments: of {str([*treatments])[:80]}, not of {', '.join(CONCEPTS)}"
    _require(set(treatments) == set(CONCEPTS), fault)
    for action in treatments.values():  # of any robot: other actions than the paper's are allowed
        is_name = isinstance(action, str) and re.fullmatch(r"[a-z][a-z0-9_]{0,39}", action)
        fault = f"treatments: {str(action)[:40]!r} is no name of an action"
        _require(is_name and action not in (NOTHING, QUEUE), fault)
    _require(len(set(treatments.values())) == len(treatments), "treatments: one action treats two concepts")
    _require(type(content["stand_in"]) is bool, "stand_in is neither true nor false")
    _require_classifier(content["gpc"], CONCEPTS, encoder.require_weights())


def _is_line(text: object) -> bool:
    return isinstance(text, str) and text.isprintable()


def _require_diagnoser(state: Mapping) -> None:
    read_settings(UncertaintySettings, state["runs"])
    read_settings(ICPSettings, state["icp"])
    settings = read_settings(ReenactmentSettings, state["reenactment"])
    for name, allowed in (("reads", (READS,)), ("moved", get_args(Moved))):
        _require(state[name] in allowed, f"{name}: {str(state[name])[:40]!r} is not one of {', '.join(allowed)}")
    classifier, starts = state["classifier"], state["runs"]["starts"]
    _require_count("points of a description", state["points"], FEWEST_CLOUD_POINTS, MOST_CLOUD_POINTS)
    _require_count("starts", starts, FEWEST_STARTS, MOST_RUNS)
    _require_count("iterations of ICP", state["icp"]["max_iterations"], 1, MOST_ITERATIONS)
    _require_count("classifiers of causes", len(classifier["causes"]), len(CONCEPTS), len(CONCEPTS))
    _require_count("re-enactments", settings.calls(starts), 1, MOST_RUNS)
    quantiles, judge, levels = classifier["quantiles"], state["judge"], state["levels"]
    sized = quantiles.ndim == 2 and len(quantiles) > 1 and quantiles.shape[1] == FEATURE_COUNT
    _require(sized, f"'quantiles' has shape {quantiles.shape}, not {FEATURE_COUNT} descriptors")
    _require(not (np.diff(quantiles, axis=0) < 0).any(), "'quantiles' decrease")
    usual = classifier.get("usual_distance", 1.0)
    _require(type(usual) is float and 0 < usual < MOST_DRAWS, f"usual_distance: {usual!r} is not a distance")
    for name, numbers in (("weights", PROBABILITY), ("error_weights", ERROR)):
        _require_shape(name, judge[name], (len(numbers) + 1,))
    if judge.get("trees") is not None:
        require_trees(judge["trees"], len(OF_TREES) + DESCRIPTORS)
    _require(levels and isinstance(levels, list), "no tolerance is calibrated")
    for level in levels:
        tolerance = level["tolerance"]
        _require(type(tolerance) is float and 0 < tolerance <= 1, f"tolerance: {tolerance!r} is not a share")
    repaired = [level["repaired_below"] for level in levels if level.get("repaired_below") is not None]
    for threshold in (state["start_threshold"], *(level["threshold"] for level in levels), *repaired):
        _require(type(threshold) is float and 0 <= threshold <= 2, f"threshold: {threshold!r} is not a probability")
    causes = [(cause, (ABSENT, PRESENT)) for cause in classifier["causes"]]
    for gpc, classes in [(classifier["failure"], (NOMINAL, FAILED)), *causes]:
        _require_count("draws of a classifier", gpc["settings"]["draws"], 2, MOST_DRAWS)
        read_settings(GPCSettings, gpc["settings"])
        _require_classifier(gpc, classes, FEATURE_COUNT)
    _require_count("questions of trees", len(classifier["trees"]), 1 + len(CONCEPTS), 1 + len(CONCEPTS))
    for question in classifier["trees"]:
        require_trees(question, FEATURE_COUNT)
    for level in levels:
        if level["guarantee"] is not None:
            sets = Guarantee.from_dict(level["guarantee"]).state_sets
            same = sets.states in (STATES, WHETHER_FAILED) and 0 < sets.level < 1
            _require(same, "its guarantee is of different states, or of none")
    measures = [state["held_out"], *(level.get("held_out", {}) for level in levels)]
    for name, value in (item for each in measures for item in each.items()):
        is_measure = type(name) is str and name.isidentifier() and type(value) is float and 0 <= value < MOST_DRAWS
        _require(is_measure, f"held_out: {str(name)[:40]!r} is not the name of a measure with a value")


def _require_shape(name: str, array: np.ndarray, shape: tuple[int, ...]) -> None:
    _require(array.shape == shape, f"'{name}' has shape {array.shape}, not {shape}")


def _require_classifier(state: Mapping, classes: tuple[str, ...], d: int) -> None:
    fault = f"its classes are {str(state['classes'])[:80]}, not {', '.join(classes)}"
    _require(tuple(state["classes"]) == classes, fault)  # their order is that of the scores
    n_classes, m, n = len(classes), len(state["inducing"]), len(state["labelled"])
    shapes = {"scaler_mean": (d,), "scaler_scale": (d,), "inducing": (m, d), "labelled": (n, d), "targets": (n,)}
    for name, shape in (shapes | {"mean": (n_classes, m), "covariance": (n_classes, m, m)}).items():
        _require_shape(name, state[name], shape)
        _require(name == "targets" or state[name].dtype.kind == "f", f"'{name}' does not hold real numbers")
    axes = state["axes"]
    named = not isinstance(axes, str) and all(isinstance(axis, str | int) for axis in axes)
    _require(named, "the names of its seed are neither texts nor numbers")
    _require(set(state["kernel"]) == {"scale", "parameter"}, "its kernel has different parts")
    for name, values in state["kernel"].items():
        _require_shape(name, values, (n_classes,))
        _require(values.dtype.kind == "f" and (values > 0).all(), f"'{name}' of its kernel is not above 0")
    _require((state["scaler_scale"] > 0).all(), "'scaler_scale' contains values that are not above 0")
    covariance = state["covariance"].astype(np.float64)
    # Cholesky reads one triangle alone.
    asymmetry = np.abs(covariance - np.swapaxes(covariance, 1, 2)).max(initial=0)
    _require(asymmetry <= ASYMMETRY, "'covariance' is not symmetric")
    np.linalg.cholesky(covariance)  # LinAlgError, a ValueError, unless they are positive definite
    targets = state["targets"]
    possible = targets.dtype.kind == "i" and ((targets >= 0) & (targets < n_classes)).all()
    _require(possible, "'targets' names a missing concept")
