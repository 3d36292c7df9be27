"""The trained part of a model that diagnoses a registration, and its training on measured causes.

Threshold and guarantee are calibrated on unseen families of shapes: each fold of the families is judged by a classifier
trained on the others. The final classifier is trained on all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.settings import CauseSettings, Moved
from gpca.causes.truth import ALL, BORDERLINE, LARGEST_ERROR, NOMINAL
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.evaluation.conformal import highest_level
from gpca.explainers.pair_classifier import Judgment, PairClassifier
from gpca.guarantee.guarantee import Guarantee, calibrate, states_of
from gpca.io.container import Container, array
from gpca.model.diagnosis import Diagnosis, Guaranteed, Reenacted, state_probabilities
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import Reenactments, reenactment_features, row_of
from gpca.reenactment.enactment import Enactment, reenact
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import exp, inverse, transform
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings

SMALLEST_ERROR = 1e-3  # diameters; the spacing of the points hides smaller errors
READS = "reenacted"  # the name of the features in a model file
QUICK_POINTS, QUICK_HYPOTHESES = 384, 2  # limits of a quick diagnosis; 256 points give twice as many false alarms
MOST_REENACTED = 512  # points of a user's cloud; twice as many take twice the time without a gain
RIDGE = 10.0  # penalty of the regression of the error, in samples
FOLDS = 3  # of the families
LEVEL = 0.9  # probability that a set of states contains the true one
MISSED = 0.05  # largest probability that a failure is called good


@dataclass(frozen=True)
class Diagnoser:
    """Classifiers on the features of a pair, and the settings with which these are measured."""

    classifier: PairClassifier  # of failure and of the causes
    error_weights: np.ndarray  # (F + 1,) regression of ln error (diameters) on the normalized features, constant last
    threshold: float  # probability of failure from which a registration is called failed
    points: int  # maximum number of points per cloud
    runs: UncertaintySettings  # spread of ICP over other starts
    moved: Moved  # the cloud that ICP moves in a re-enactment
    reenactment: ReenactmentSettings  # search for the true pose
    guarantee: Guarantee | None  # sets of states and alarm; None in quick diagnoses
    held_out: Mapping[str, float]  # measures of accuracy on unseen families of shapes

    def quick(self) -> Diagnoser:
        """Return a diagnoser with fewer points and hypotheses and therefore without a guarantee."""
        reenactment = replace(self.reenactment, hypotheses=min(self.reenactment.hypotheses, QUICK_HYPOTHESES))
        return replace(self, points=min(self.points, QUICK_POINTS), reenactment=reenactment, guarantee=None)

    @property
    def truth(self) -> CauseSettings:
        """Settings of the registrations that a re-enactment repeats."""
        return CauseSettings(**vars(self.runs), moved=self.moved)

    def diagnose(
        self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray, register: bool = True
    ) -> tuple[Diagnosis, list[Enactment]]:
        """Diagnose a registration, and return its re-enactments; the same clouds give the same numbers.

        Args:
            observed: (N, 3) at the initial pose, in diameters and in the model's frame.
            model: (M, 3).
            T_icp: (4, 4) result of ICP, maps the observed cloud to the model.
            register: whether ICP may end its descent on the drawn points; otherwise the pose is taken as it is.
        """
        features_F, reenacted, enactments = self.measured(observed, model, T_icp, register)
        inputs_1_F = self.classifier.normalized(features_F[None])
        judged = self.classifier.judge(inputs_1_F)
        log_error = float(inputs_1_F[0] @ self.error_weights[:-1] + self.error_weights[-1])
        diagnosis = Diagnosis(
            failure=float(judged.failure_N[0]),
            threshold=self.threshold,
            causes=dict(zip(CONCEPTS, judged.causes_N_3[0].tolist(), strict=True)),
            variances=dict(zip(CONCEPTS, judged.causes_variances_N_3[0].tolist(), strict=True)),
            bald=float(judged.bald_N[0]),
            expected_error=float(np.clip(np.exp(log_error), SMALLEST_ERROR, LARGEST_ERROR)),
            unlikeness=float(self.classifier.unlikeness(inputs_1_F)[0]),
            void=False,
            guarantee=Guaranteed.of(self.guarantee, state_probabilities(judged)) if self.guarantee else None,
            reenacted=reenacted,
        )
        return diagnosis, enactments

    def measured(
        self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray, register: bool = True
    ) -> tuple[np.ndarray, Reenacted, list[Enactment]]:
        """Return the features (F,) of the pair with the results of ICP from other starts, and its re-enactment."""
        observed, model = (
            cloud[generator("diagnosis", role).permutation(len(cloud))[: self.points]]
            for role, cloud in (("observed", observed), ("model", model))
        )
        starts_n = exp(generator("diagnosis", "starts").normal(size=(self.runs.starts, 6)) * self.runs.deviation_6())
        starts_n[0] = T_icp
        icp = BatchedICP(model, self.runs.icp)
        T_n, fitness_n, rmse_n = icp.register(observed, starts_n)
        if not register:
            T_n[:1], fitness_n[:1], rmse_n[:1] = icp.register(observed, starts_n[:1], max_iterations=0)
        T_back, points = inverse(T_n[0]), transform(T_n[0], observed)
        pair = ObservedPair(points, model, T_back, T_n @ T_back, fitness_n, rmse_n, axes=("diagnosis",))
        surface = ModelSurface(model)
        enactments = reenact(pair, self.reenactment, self.truth, surface)
        row = row_of(enactments, pair, self.reenactment, self.truth)
        reenacted = Reenacted.of(enactments, row["weight"][: len(enactments)], T_icp, surface)
        return reenactment_features(Reenactments.of_rows([row], self.truth))[0], reenacted, enactments

    def state(self) -> dict[str, object]:
        """Return arrays, numbers and names for :meth:`from_state`."""
        return {
            "reads": READS,
            "classifier": self.classifier.state(),
            "error_weights": self.error_weights,
            "threshold": self.threshold,
            "points": self.points,
            "runs": {name: value for name, value in asdict(self.runs).items() if name != "icp"},
            "icp": asdict(self.runs.icp),
            "moved": self.moved,
            "reenactment": asdict(self.reenactment),
            "guarantee": self.guarantee and self.guarantee.to_dict(),
            "held_out": dict(self.held_out),
        }

    @classmethod
    def from_state(cls, state: Mapping) -> Diagnoser:
        """Return the diagnoser of a :meth:`state`."""
        return cls(
            classifier=PairClassifier.from_state(state["classifier"]),
            error_weights=state["error_weights"],
            threshold=state["threshold"],
            points=state["points"],
            runs=UncertaintySettings(**state["runs"], icp=ICPSettings(**state["icp"])),
            moved=state["moved"],
            reenactment=ReenactmentSettings(**state["reenactment"]),
            guarantee=Guarantee.from_dict(state["guarantee"]),
            held_out=state["held_out"],
        )


@dataclass(frozen=True)
class TrainingSet(Container):
    """N registrations with measured causes."""

    features_N_F: np.ndarray = array("N F")  # :func:`gpca.reenactment.dataset.reenactment_features`
    label_N: np.ndarray = array("N")  # nominal, a dominant cause, or borderline
    state_N: np.ndarray = array("N")  # the label, but ``several`` for failures with several causes
    causes_N_3: np.ndarray = array("N 3")  # whether each concept is a cause
    error_N: np.ndarray = array("N")  # mean over the starts, diameters
    family_N: np.ndarray = array("N")  # family of the shape

    @classmethod
    def of(cls, causes: Causes, reenactments: Reenactments) -> TrainingSet:
        """Return the training set of one source."""
        truth = causes.truth
        features, label_N, state_N = reenactment_features(reenactments), labels_of(truth), states_of(truth)
        return cls(features, label_N, state_N, truth.causes, truth.error[:, ALL], causes.registrations.cluster)

    def classifier(self, gpc: GPCSettings, *axes: object) -> PairClassifier:
        """Train a classifier."""
        made = PairClassifier(gpc, *axes, trees=True)
        return made.fit(self.features_N_F, self.label_N != NOMINAL, self.causes_N_3)


def learn(
    training: TrainingSet,
    gpc: GPCSettings,
    causes: CauseSettings,
    reenactment: ReenactmentSettings,
    false_alarms: float,
    *axes: object,
) -> tuple[Diagnoser, np.ndarray]:
    """Return the trained diagnoser, and the BALD (nats) of failures of unseen families.

    At most the share `false_alarms` of nominal registrations of unseen families reaches the threshold of failure.
    """
    clear = training.subset(training.label_N != BORDERLINE)
    judged = judged_unseen(clear, gpc, *axes)
    nominal_N = clear.label_N == NOMINAL
    threshold = threshold_of(judged.failure_N[nominal_N], false_alarms)
    classifier = clear.classifier(gpc, *axes)
    # Sets of states hold for new families if there are enough families. The alarm's level is too high for their number:
    # it is calibrated on single samples, and holds as far as registrations of a new family are like the others.
    scores_N_5 = state_probabilities(judged)
    family_N = clear.family_N if highest_level(clear.family_N) >= LEVEL else None
    by_family, single = (
        calibrate(scores_N_5, clear.state_N, families, level=LEVEL, missed=MISSED, false_alarms=false_alarms)
        for families in (family_N, None)
    )
    diagnoser = Diagnoser(
        classifier=classifier,
        error_weights=fit_error(classifier.normalized(training.features_N_F), training.error_N),
        threshold=threshold,
        points=min(causes.points[1], MOST_REENACTED),
        runs=causes.runs(),
        moved=causes.moved,
        reenactment=reenactment,
        guarantee=Guarantee(by_family.state_sets, single.failure_alarm, by_family.samples, by_family.families),
        held_out=measured(clear, judged, threshold),
    )
    return diagnoser, judged.bald_N[~nominal_N]


def judged_unseen(training: TrainingSet, gpc: GPCSettings, *axes: object) -> Judgment:
    """Judge every registration by a classifier trained on other families; an InputError if there is a single one."""
    from sklearn.model_selection import GroupKFold

    count = len(training.label_N)
    if (families := len(np.unique(training.family_N))) < 2:
        raise InputError("model", "learns from objects of a single family", "add a source of others")
    shapes = {"failure_N": (), "causes_N_3": (3,), "causes_variances_N_3": (3,), "bald_N": ()}
    parts = {name: np.full((count, *shape), np.nan) for name, shape in shapes.items()}
    folds = GroupKFold(min(FOLDS, families)).split(training.label_N, groups=training.family_N)
    for fold, (seen, unseen) in enumerate(folds):
        classifier = training.subset(seen).classifier(gpc, *axes, "calibration", fold)
        judged = classifier.judge(classifier.normalized(training.features_N_F[unseen]))
        for name, part in parts.items():
            part[unseen] = getattr(judged, name)
    return Judgment(**parts)


def measured(training: TrainingSet, judged: Judgment, threshold: float) -> dict[str, float]:
    """Measures of accuracy (docs/causes.md) for the card of the model."""
    from sklearn.metrics import roc_auc_score

    failed_N = training.label_N != NOMINAL
    scores_N_4 = np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])
    right_N = np.array(LABELS)[scores_N_4.argmax(axis=1)] == training.label_N
    present = [label for label in LABELS if (training.label_N == label).any()]
    first_N = np.array(LABELS[1:])[judged.causes_N_3.argmax(axis=1)]
    alarm_N = judged.failure_N >= threshold
    both = failed_N.any() and not failed_N.all()
    return {
        "samples": float(len(failed_N)),
        "families": float(len(np.unique(training.family_N))),
        "balanced_accuracy": float(np.mean([right_N[training.label_N == label].mean() for label in present])),
        "dominant_accuracy": float((first_N == training.label_N)[failed_N].mean()) if failed_N.any() else 0.0,
        "auroc_failed": float(roc_auc_score(failed_N, judged.failure_N)) if both else 0.5,
        "false_alarms": float(alarm_N[~failed_N].mean()),
        "missed": float((~alarm_N)[failed_N].mean()) if failed_N.any() else 0.0,
    }


def threshold_of(failure_N: np.ndarray, false_alarms: float) -> float:
    """Return the smallest probability of failure that at most the share `false_alarms` of nominal samples reaches."""
    if not len(failure_N):
        raise InputError("model", "has no nominal registration", "raise causes.train or causes.shares.nominal")
    return float(np.nextafter(np.quantile(failure_N, 1 - false_alarms, method="inverted_cdf"), 1))


def fit_error(inputs_N_F: np.ndarray, error_N: np.ndarray) -> np.ndarray:
    """Fit a ridge regression of ln error on normalized features: weights (F + 1,), the constant last."""
    from sklearn.linear_model import Ridge

    fitted = Ridge(alpha=RIDGE).fit(inputs_N_F, np.log(np.maximum(error_N, SMALLEST_ERROR)))
    return np.append(fitted.coef_, fitted.intercept_)
