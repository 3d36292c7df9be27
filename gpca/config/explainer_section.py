"""The sections of explainers in the config; an explainer without an entry here checks its settings itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from gpca.classifier.settings import GPCSettings, LearningRate
from gpca.settings import Bounds, Count, Positive, PositiveShare

DescribedPoints = Annotated[int, Bounds(minimum=16, maximum=65536)]


@dataclass(frozen=True)
class Analytical(GPCSettings):
    """How local shape is measured, and the settings of the GPC."""

    shape_points: Count = 256
    neighbours: Annotated[int, Bounds(minimum=4)] = 16


@dataclass(frozen=True)
class Removal:
    """What a remedy is worth."""

    worth: Literal["uncertainty", "residual"] = "uncertainty"


@dataclass(frozen=True)
class Probes:
    """Logistic regressions."""

    inverse_regularisation: Positive = 1.0


@dataclass(frozen=True)
class LogisticOfResiduals(Probes):
    """A logistic regression of residuals, whose logarithm has a floor."""

    floor: Positive = 1e-4


@dataclass(frozen=True)
class ForestOfResiduals:
    """A random forest of residuals, whose logarithm has a floor."""

    trees: Count = 200
    floor: Positive = 1e-4


@dataclass(frozen=True)
class RulesOfResiduals:
    """A shallow tree of residuals, whose logarithm has a floor."""

    depth: Annotated[int, Bounds(minimum=1, maximum=20)] = 3
    smallest_leaf: Annotated[float, Bounds(exclusiveMinimum=0, maximum=0.5)] = 0.02
    floor: Positive = 1e-4


@dataclass(frozen=True)
class Boosting:
    """Gradient boosting on the descriptors of a pair."""

    iterations: Count = 150
    learning_rate: LearningRate = 0.06


@dataclass(frozen=True)
class Forest:
    """A forest on the descriptors of a pair."""

    trees: Count = 300
    smallest_leaf: Count = 2


@dataclass(frozen=True)
class PairClassifier(GPCSettings):
    """How many points of each cloud are described, and the settings of the GPC."""

    points: DescribedPoints = 512


@dataclass(frozen=True)
class LearnedPair(PairClassifier):
    """Besides, how the encoder of the pair is trained."""

    draw_points: DescribedPoints = 96
    epochs: Count = 6
    encoder_learning_rate: PositiveShare = 4e-3


@dataclass(frozen=True)
class ForestOfPairs:
    """A forest on distances, and how many points of each cloud these are between."""

    trees: Count = 200
    points: DescribedPoints = 512


@dataclass(frozen=True)
class DensityOfPairs(Probes):
    """A logistic regression of densities, and of how many points of each cloud these are."""

    points: DescribedPoints = 512


CAUSE_EXPLAINERS = {
    "gpca": GPCSettings | None,
    "gpca_pair": GPCSettings | None,
    "gpca_multilabel": GPCSettings | None,
    "concept_vectors": Probes | None,
    "residuals": Probes | None,
    "density": Probes | None,
    "entropies": Probes | None,
    "pair_forest": Forest | None,
    "pair_boosting": Boosting | None,
}
EXPLAINERS = {
    "gpca": GPCSettings | None,
    "gpca_paper": GPCSettings | None,
    "analytical_gpc": Analytical | None,
    "analytical_gpc_no_counts": Analytical | None,
    "concept_vectors": Probes | None,
    "shap_removal": Removal | None,
    "shap_removal_residual": Removal | None,
    "shap_supervised": Probes | None,
    "sa_local_removal": Removal | None,
    "sa_local_removal_residual": Removal | None,
    "sa_supervised": Probes | None,
    "residuals_logistic": LogisticOfResiduals | None,
    "residuals_forest": ForestOfResiduals | None,
    "residuals_rules": RulesOfResiduals | None,
    "gpca_pair": PairClassifier | None,
    "gpca_pair_dgcnn": LearnedPair | None,
    "gpca_pair_attention": LearnedPair | None,
    "pair_forest": ForestOfPairs | None,
    "density": DensityOfPairs | None,
}
