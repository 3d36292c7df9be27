"""The groups of readings by name: the choice, the files and the function of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gpca.experiments.specification_curve import settings
from gpca.registry import load

FRAME_INPUT = "frame_input"  # the group that trains an encoder of frames for each of its readings
ALL_SOURCES = ("coffee_cup", "linemod", "ycb")


@dataclass(frozen=True)
class Group:
    """A group of choices that the paper leaves open.

    Attributes:
        title: the open question in words.
        choices: the class of its choices.
        run: ``module:function`` beside this module, of the files given, the readings and their sizes, that
            yields reading, source, method, metric, concept, seed and value, named as in published.csv.
        reads: kinds of files, fields of :class:`gpca.experiments.specification_curve.run_files.RunFiles`.
        sources: those whose printed numbers are compared; empty for depth frames.
        methods: those whose predictions it reads.
        explainers: those that it fits itself, found by name.
        costly: it takes minutes a seed, so that it sees the first one alone.
    """

    title: str
    choices: type
    run: str
    reads: tuple[str, ...]
    sources: tuple[str, ...] = ALL_SOURCES
    methods: tuple[str, ...] = ()
    explainers: tuple[str, ...] = ()
    costly: bool = False

    @property
    def module(self) -> str:
        """The module that runs it."""
        return f"gpca.experiments.specification_curve.{self.run.partition(':')[0]}"

    def function(self) -> Callable:
        """Return the function that runs it."""
        return load(f"gpca.experiments.specification_curve.{self.run}")


_LEARNERS = ("gpca_paper", "learner_forest", "learner_linear_svm")
GROUPS = {
    "sensitivity": Group("What SA differentiates", settings.Sensitivity, "knobs:sensitivity", ("registrations",)),
    "shap": Group("What SHAP's uncertainty is of", settings.Shap, "knobs:shap", ("registrations",)),
    "severities": Group(
        "How strong the perturbations are",
        settings.TestSeverities,
        "severities:run",
        ("registrations", "predictions"),
        methods=("gpca_paper", "gpca"),
    ),
    "gpc_start": Group(
        "How the GPC starts", settings.GPCStart, "gpc_start:run", ("sets",), ("ycb", "linemod"), costly=True
    ),
    "kernel": Group("Kernel of Table V's GPC", settings.TableKernel, "learners:kernel", ("sets",)),
    "linear_svm": Group("Which linear SVM", settings.LinearSVM, "learners:linear_svm", ("sets",)),
    "encoder_head": Group(
        "Head that trains the encoder",
        settings.EncoderHead,
        "learners:encoder_head",
        ("registrations", "sets"),
        ("linemod",),
        explainers=("learner_forest",),
    ),
    "diagnostics": Group(
        "Set, distance, score and area of ρ, AUC and ECE",
        settings.Diagnostics,
        "diagnostics:run",
        ("sets", "predictions"),
        ("ycb",),
        _LEARNERS,
    ),
    "pool": Group("Pool, batch and start of active learning", settings.LabelPool, "labels:pool", ("sets",)),
    "epochs": Group("What an epoch is", settings.Epochs, "labels:epochs", ("sets",)),
    "frames": Group(
        "What varies on depth frames",
        settings.FrameRepeats,
        "frames:run",
        ("registrations", "predictions", "embeddings"),
        (),
    ),
    FRAME_INPUT: Group(
        "What the encoder sees on depth frames",
        settings.FrameInput,
        "frame_input:run",
        ("registrations", "poses", "predictions"),
        (),
    ),
    "features": Group(
        "Classic features", settings.ClassicFeatures, "learners:classic_features", ("registrations",), ("ycb",)
    ),
}
