"""The diagnosis of one registration, by the part of a model that learned from measured causes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from sys import intern

import numpy as np
import torch

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings
from gpca.alignment.rigid import inverse, transform
from gpca.alignment.twist import exp
from gpca.causes.settings import OBSERVED, CauseSettings, Moved
from gpca.causes.truth import LARGEST_ERROR
from gpca.explainers.pair_classifier import PairClassifier
from gpca.features.dataset import describe
from gpca.features.pair import ObservedPair
from gpca.features.settings import GROUPS, DescriptorSettings
from gpca.guarantee.guarantee import Guarantee
from gpca.model.diagnosis import Diagnosis
from gpca.model.guaranteed import Guaranteed, scores_of_states
from gpca.model.reenacted import Reenacted
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import Reenactments, row_of
from gpca.reenactment.enactment import Enactment, reenact
from gpca.reenactment.features import reenactment_features
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings

SMALLEST_ERROR = 1e-3  # diameters; below it lies the spacing of the points
REENACTED, REMEDIED = ("reenacted", "remedied")  # what a diagnoser reads of a pair
QUICK_POINTS, QUICK_HYPOTHESES = 384, 2  # of a quick diagnosis, at most; with 256, twice as many false alarms


@dataclass(frozen=True)
class Diagnoser:
    """Classifiers on the features of a pair, and the settings by which a pair is measured as in the training.

    Attributes:
        classifier: of failure and of the causes.
        error_weights: (F + 1,) regression of ln error (diameters) on the normalized features, the constant last.
        threshold: probability of failure from which something is called wrong.
        points: of each cloud, at most.
        runs: how ICP runs from other starts.
        reads: ``reenacted``, the numbers of a re-enactment; or ``remedied``, all groups of descriptors, as models
            before version 4 do.
        moved: the cloud that ICP moves in a re-enactment.
        reenactment: how the true pose is sought.
        descriptors: how pairs are registered with remedies.
        guarantee: of what is said; None of older models and of a quick diagnosis.
        held_out: how well classifiers that learned from other families of shapes did, by measure; empty of older ones.
    """

    classifier: PairClassifier
    error_weights: np.ndarray
    threshold: float
    points: int
    runs: UncertaintySettings
    reads: str = REENACTED
    moved: Moved = OBSERVED
    reenactment: ReenactmentSettings = field(default_factory=ReenactmentSettings)
    descriptors: DescriptorSettings = field(default_factory=DescriptorSettings)
    guarantee: Guarantee | None = None
    held_out: Mapping[str, float] = field(default_factory=dict)

    def quick(self) -> Diagnoser:
        """Return it for a quick diagnosis: with fewer points and hypotheses, and no promise, which needs them all."""
        reenactment = replace(self.reenactment, hypotheses=min(self.reenactment.hypotheses, QUICK_HYPOTHESES))
        return replace(self, points=min(self.points, QUICK_POINTS), reenactment=reenactment, guarantee=None)

    def diagnose(self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray) -> Diagnosis:
        """Diagnose a registration; the same clouds give the same numbers.

        Args:
            observed: (N, 3) where ICP started, in diameters and in the model's frame.
            model: (M, 3).
            T_icp: 4×4, what ICP found: takes the observed cloud to the model.
        """
        features_F, reenacted = self.measured(observed, model, T_icp)
        inputs_1_F = self.classifier.normalized(features_F[None])
        judged = self.classifier.judge(inputs_1_F)
        log_error = float(inputs_1_F[0] @ self.error_weights[:-1] + self.error_weights[-1])
        return Diagnosis(
            failure=float(judged.failure_N[0]),
            threshold=self.threshold,
            causes=dict(zip(CONCEPTS, judged.causes_N_3[0].tolist(), strict=True)),
            variances=dict(zip(CONCEPTS, judged.causes_variances_N_3[0].tolist(), strict=True)),
            bald=float(judged.bald_N[0]),
            expected_error=float(np.clip(np.exp(log_error), SMALLEST_ERROR, LARGEST_ERROR)),
            unlikeness=float(self.classifier.unlikeness(inputs_1_F)[0]),
            guarantee=Guaranteed.of(self.guarantee, scores_of_states(judged)) if self.guarantee else None,
            reenacted=reenacted,
        )

    def measured(
        self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray
    ) -> tuple[np.ndarray, Reenacted | None]:
        """Return the features (F,) of the pair, and what its re-enactment says, if it has one."""
        pair = self.pair(observed, model, T_icp)
        if self.reads == REMEDIED:
            described, _ = describe(pair, self.descriptors, self.runs.icp)
            return np.concatenate([described[group] for group in GROUPS]), None
        surface = ModelSurface(pair.model)
        enactments, truth = self.enacted(pair, surface)
        row = row_of(enactments, pair, self.reenactment, truth)
        said = Reenacted.of(enactments, row["weight"][: len(enactments)], T_icp, surface)
        return reenactment_features(Reenactments.of_rows([row], truth))[0], said

    def enacted(self, pair: ObservedPair, surface: ModelSurface) -> tuple[list[Enactment], CauseSettings]:
        """Return the re-enactments of a :meth:`pair`, the most probable first, and how they were registered."""
        truth = CauseSettings(**vars(self.runs), moved=self.moved)
        return reenact(pair, self.reenactment, truth, surface), truth

    def enacted_again(
        self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray
    ) -> tuple[list[Enactment], CauseSettings]:
        """Return what :meth:`diagnose` re-enacts of the same clouds."""
        pair = self.pair(observed, model, T_icp)
        return self.enacted(pair, ModelSurface(pair.model))

    def pair(self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray) -> ObservedPair:
        """Return the pair with runs of ICP from other starts, as the training has them."""
        observed, model = _drawn(observed, self.points, "observed"), _drawn(model, self.points, "model")
        starts_n = exp(generator("diagnosis", "starts").normal(size=(self.runs.starts, 6)) * self.runs.deviation_6())
        starts_n[0] = T_icp
        T_n, fitness_n, rmse_n = BatchedICP(model, self.runs.icp).register(observed, starts_n)
        T_back = inverse(T_n[0])
        return ObservedPair(
            observed=transform(T_n[0], observed),
            model=model,
            T_init=T_back,
            T_runs=T_n @ T_back,
            fitness_n=fitness_n,
            inlier_rmse_n=rmse_n,
            axes=("diagnosis",),
        )

    def state(self) -> dict[str, object]:
        """Return tensors, numbers and names for :meth:`from_state`."""
        own = {REENACTED: "reenactment", REMEDIED: "descriptors"}[self.reads]
        return {
            "reads": self.reads,
            "classifier": self.classifier.state(),
            "error_weights": torch.from_numpy(self.error_weights),
            "threshold": self.threshold,
            "points": self.points,
            "runs": {name: value for name, value in asdict(self.runs).items() if name != "icp"},
            "icp": asdict(self.runs.icp),
            "moved": self.moved,
            own: asdict(getattr(self, own)),
            "guarantee": self.guarantee and self.guarantee.to_dict(),
            "held_out": dict(self.held_out),
        }

    @classmethod
    def from_state(cls, state: Mapping) -> Diagnoser:
        """Return the diagnoser of a :meth:`state`, or of one from before version 4, which read all descriptors."""
        return cls(
            classifier=PairClassifier.from_state(state["classifier"]),
            error_weights=state["error_weights"].numpy(),
            threshold=state["threshold"],
            points=state["points"],
            runs=UncertaintySettings(**state["runs"], icp=ICPSettings(**state["icp"])),
            reads=state.get("reads", REMEDIED),
            moved=state.get("moved", OBSERVED),
            reenactment=ReenactmentSettings(**state.get("reenactment", {})),
            descriptors=DescriptorSettings(**state.get("descriptors", {})),
            guarantee=Guarantee.from_dict(state["guarantee"]) if state.get("guarantee") else None,
            # As in the code, so that one text is one object: of these a file holds one.
            held_out={intern(name): value for name, value in state.get("held_out", {}).items()},
        )


def _drawn(cloud: np.ndarray, most: int, role: str) -> np.ndarray:
    return cloud[generator("diagnosis", role).permutation(len(cloud))[:most]]
