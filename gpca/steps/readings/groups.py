"""The groups of readings by name: the choices that the paper leaves open, the files and the function of each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, Literal

from gpca.classifier.settings import Kernel, LearningRate
from gpca.settings import Bounds, Count, Distinct, Keys, OpenShare, Positive

FRAME_REPEATS = "frames"  # the group that fits classifiers to depth frames anew
FRAME_ENCODER, FRAME_START = "frame_encoder", "frame_start"  # those that read other rows on frames than the judged
SEVERITIES_RETRAINED = "severities_retrained"  # the group whose encoders learn from other severities
ALL_SOURCES = ("coffee_cup", "linemod", "ycb")
AboveOne = Annotated[float, Bounds(exclusiveMinimum=1)]
AtLeastTwo = Annotated[int, Bounds(minimum=2)]
Divergence = Literal["divergence", "divergence_reversed", "log_determinant"]
Quantity = Literal[Divergence, "trace", "residual", "inlier_rmse", "inlier_rmse_of_one"]
ShiftedSet = Literal["in_distribution", "severity", "source", "objects"]
JoinedSets = Literal["in_distribution+severity", "in_distribution+source", "seen_objects+objects"]
Distance = Literal["knn_analytical", "mahalanobis_analytical", "knn_embedding", "mahalanobis_embedding"]
ShownObjects = Literal["all", "seen", "unseen"]
OtherSeverities = Literal["weaker", "stronger"]
Reading = Mapping[str, Any]  # choice -> value


@dataclass(frozen=True)
class ReadingSizes:
    """The seeds and samples that the readings of a run see."""

    seeds: Count = 2  # the first so many of the run's
    encoders: Annotated[int, Bounds(minimum=0)] = 1  # the first so many of these, for which other encoders are trained
    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 15  # test samples for Monte-Carlo ICP, balanced, at most


def readings_of(choices: Mapping[str, Sequence]) -> list[Reading]:
    """Every combination of the values of a group's choices."""
    return [dict(zip(choices, values, strict=True)) for values in product(*choices.values())]


def name_of(group: str, reading: Reading) -> str:
    """Name of a reading in `table` of its tidy rows, e.g. ``frames/classifiers/seen``."""
    return "/".join([group, *(f"{value:g}" if isinstance(value, float) else str(value) for value in reading.values())])


@dataclass(frozen=True)
class Group:
    """A group of choices that the paper leaves open."""

    title: str  # the open question in words
    choices: Mapping[str, Any]  # the type of a value of each
    run: str  # ``module:function`` beside this module, of RunFiles and readings, that yields rows
    reads: tuple[str, ...]  # kinds of files, fields of a RunFiles
    sources: tuple[str, ...] = ALL_SOURCES  # whose printed numbers are compared; none for depth frames
    methods: tuple[str, ...] = ()  # explainers or learners whose predictions it reads
    explainers: tuple[str, ...] = ()  # that it fits itself
    costly: bool = False  # minutes a seed, so that it sees the first seed alone

    @property
    def values(self) -> Any:
        """Type of its part of the config: one or more values of every choice."""
        several = {name: Distinct[kind] for name, kind in self.choices.items()}  # type: ignore[valid-type]
        return Annotated[dict, Keys(several, required=several)]

    @property
    def code(self) -> str:
        """``module:function`` that runs it."""
        return f"{__package__}.{self.run}"


GROUPS = {
    "sensitivity": Group(
        "What SA differentiates",
        {
            "quantity": Quantity,
            "sign": Literal["signed", "absolute", "lowest"],
            "unit": Literal["range", "own"],
            "step": Literal["small", "middle"],
        },
        "knobs:sensitivity",
        ("registrations",),
    ),
    "shap": Group(
        "What SHAP's uncertainty is of",
        {
            "starts": AtLeastTwo,
            "background": Literal["observed", "clean"],
            "quantity": Divergence,
            "floor": Positive,
            "sign": Literal["signed", "absolute"],
        },
        "knobs:shap",
        ("registrations",),
    ),
    "knob_sizes": Group(
        "How far SHAP and SA turn the knobs",
        {"noise": OpenShare, "spread": AboveOne, "overlap": OpenShare},
        "knobs:magnitudes",
        ("registrations",),
    ),
    "severities": Group(
        "How strong the perturbations are",
        {"part": Literal["all", "weakest", "middle", "strongest"], "classifier": Literal["paper", "converged"]},
        "subsets:thirds",
        ("registrations", "predictions"),
        methods=("gpca_paper", "gpca"),
    ),
    SEVERITIES_RETRAINED: Group(
        "How strong the perturbations are, in training too",
        {"range": OtherSeverities, "classifier": Literal["paper", "converged"]},
        "subsets:retrained",
        ("retrained",),
    ),
    "gpc_start": Group(
        "How the GPC starts",
        {
            "inputs": Literal["standardised", "unit_norm", "raw"],
            "inducing": Literal["kmeans", "random"],
            "lengthscale": Literal["median", "default"],
            "batch": Literal["full", "minibatch"],
        },
        "learners:starts",
        ("sets",),
        ("ycb", "linemod"),
        costly=True,
    ),
    "kernel": Group("Kernel of Table V's GPC", {"kernel": Kernel, "iterations": Count}, "learners:kernel", ("sets",)),
    "linear_svm": Group(
        "Which linear SVM",
        {
            "machine": Literal["svc", "linear_svc"],
            "inputs": Literal["standardised", "raw"],
            "probability": Literal["platt", "softmax"],
        },
        "learners:linear_svm",
        ("sets",),
    ),
    "encoder_head": Group(
        "Head that trains the encoder",
        {"head": Literal["linear", "two_layer"], "inputs": Literal["standardised", "raw"]},
        "learners:encoder_head",
        ("registrations", "sets"),
        ("linemod",),
        explainers=("learner_forest",),
    ),
    "diagnostics": Group(
        "Set, distance, score and area of ρ, AUC and ECE",
        {
            "set": Literal[ShiftedSet, JoinedSets],
            "distance": Distance,
            "score": Literal["max_score", "entropy", "bald"],
            "area": Literal["aurc", "auroc_error"],
        },
        "learners:diagnostics",
        ("sets", "predictions"),
        ("ycb",),
        ("gpca_matern", "learner_forest", "learner_linear_svm"),
    ),
    "pool": Group(
        "Pool, batch and start of active learning",
        {"new_share": OpenShare, "batch": Count, "initial": AtLeastTwo},
        "labels:pool",
        ("sets",),
    ),
    "labels_classifier": Group(
        "Classifier of active learning",
        {
            "learning_rate": LearningRate,
            "iterations": Count,
            "start": Literal["cold", "warm", "posterior"],
            "inputs": Literal["pool", "labeled"],
        },
        "labels:classifiers",
        ("sets",),
    ),
    "epochs": Group(
        "What an epoch is",
        {"learning_rate": LearningRate, "labels": Literal["at_target", "all"]},
        "labels:epochs",
        ("sets",),
    ),
    FRAME_REPEATS: Group(
        "What varies on depth frames",
        {"repeats": Literal["everything", "classifiers", "samples"], "objects": ShownObjects},
        "subsets:repeats",
        ("registrations", "predictions", "embeddings"),
        (),
    ),
    FRAME_ENCODER: Group(
        "Which architecture encodes depth frames",
        {"architecture": Literal["judged", "published"], "objects": ShownObjects},
        "subsets:other_rows",
        ("registrations", "predictions"),
        (),
    ),
    FRAME_START: Group(
        "Where ICP starts on depth frames",
        {"initial_pose": Literal["true_pose", "estimated"], "objects": ShownObjects},
        "subsets:other_rows",
        ("registrations", "predictions"),
        (),
    ),
    "features": Group(
        "Classic features",
        {"features": Literal["all", "no_counts", "no_residual", "residual", "counts"]},
        "learners:classic_features",
        ("registrations",),
        ("ycb",),
    ),
}
