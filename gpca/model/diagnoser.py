"""The trained part of a model that diagnoses a registration; thresholds are calibrated on unseen families of shapes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from gpca.alignment.batched_icp import icp_to
from gpca.alignment.icp import ICPSettings, Method
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.settings import CauseSettings, Moved
from gpca.causes.truth import BORDERLINE, GEOMETRY, NOMINAL
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.evaluation.conformal import highest_level
from gpca.evaluation.intervals import interval, pigeonhole_weights, weighted_mean
from gpca.explainers.pair_classifier import Judgment, PairClassifier
from gpca.guarantee.guarantee import SEVERAL, Guarantee, calibrate
from gpca.io.container import array
from gpca.model.diagnosis import Diagnosis, Guaranteed, Reenacted, state_probabilities
from gpca.model.result import DEFAULT_TOLERANCE, TOLERANCES, UNCALIBRATED, Calibrated, Evidence, ResultJudge, level_at
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.dataset import DESCRIPTORS, Reenactments, reenactment_features, row_of
from gpca.reenactment.enactment import Enactment, reenact
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import exp, inverse, inverses, transform
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings

READS = "reenacted"  # the name of the features in a model file
QUICK_POINTS, QUICK_HYPOTHESES = 384, 2  # limits of a quick diagnosis; 256 points give twice as many false alarms
MOST_REENACTED = 512  # points of a user's cloud; twice as many take twice the time without a gain
FOLDS = 3  # of the families
LEVEL = 0.9  # probability that a set of states contains the true one
MISSED = 0.05  # largest probability that a failure is called good
ENDS = ("_low", "_high")  # of the interval of a measure
# Method of a registration -> the ICP that runs it again.
RUN_AGAIN: dict[str, Method] = {"point_to_plane": "point_to_plane", "gicp": "generalized", "gicp_small": "generalized"}


@dataclass(frozen=True)
class Diagnoser:
    """Classifiers on the features of a pair, and the settings with which these are measured."""

    classifier: PairClassifier  # of the start's failure and of the causes
    start_threshold: float  # probability from which a start is called bad
    judge: ResultJudge  # of the result
    levels: tuple[Calibrated, ...]  # its thresholds and guarantees at some tolerances
    points: int  # maximum number of points per cloud
    runs: UncertaintySettings  # spread of ICP over other starts
    moved: Moved  # the cloud that ICP moves in a re-enactment
    reenactment: ReenactmentSettings  # search for the true pose
    held_out: Mapping[str, float]  # measures of accuracy on unseen families of shapes

    def quick(self) -> Diagnoser:
        """Return a diagnoser with fewer points and hypotheses and therefore without a guarantee."""
        reenactment = replace(self.reenactment, hypotheses=min(self.reenactment.hypotheses, QUICK_HYPOTHESES))
        levels = tuple(replace(level, guarantee=None) for level in self.levels)
        return replace(self, points=min(self.points, QUICK_POINTS), reenactment=reenactment, levels=levels)

    def by_method(self, method: str | None) -> Diagnoser:
        """Return a diagnoser that registers again by a method, if it is a kind of ICP that runs from many starts."""
        if (kind := RUN_AGAIN.get(method or "", self.runs.icp.method)) == self.runs.icp.method:
            return self
        return replace(self, runs=replace(self.runs, icp=replace(self.runs.icp, method=kind)))

    @property
    def truth(self) -> CauseSettings:
        """Settings of the registrations that a re-enactment repeats."""
        return CauseSettings(**vars(self.runs), moved=self.moved)

    @property
    def at_default(self) -> Calibrated:
        """What holds of results at the default tolerance."""
        return level_at(self.levels, DEFAULT_TOLERANCE)

    def diagnose(
        self,
        observed: np.ndarray,
        model: np.ndarray,
        T_icp: np.ndarray,
        register: bool = True,
        tolerance: float = DEFAULT_TOLERANCE,
    ) -> tuple[Diagnosis, list[Enactment]]:
        """Diagnose the pose of a cloud (N, 3), at its initial one, on a model (M, 3), and return re-enactments."""
        features_F, evidence, reenacted, enactments = self.measured(observed, model, T_icp, register)
        described_1_F = features_F[None, -DESCRIPTORS:] if register else None
        inputs_1_F = self.classifier.normalized(features_F[None])
        judged = self.classifier.judge(inputs_1_F)
        result_1 = self.judge.probability(evidence, tolerance, described_1_F)
        level = level_at(self.levels, tolerance)
        scores_1_5, guarantee = state_probabilities(judged.causes_N_3, result_1), level.guarantee
        diagnosis = Diagnosis(
            result=float(result_1[0]),
            threshold=level.threshold,
            tolerance=tolerance,
            tolerance_share=tolerance,
            start=float(judged.failure_N[0]),
            start_threshold=self.start_threshold,
            causes=dict(zip(CONCEPTS, judged.causes_N_3[0].tolist(), strict=True)),
            variances=dict(zip(CONCEPTS, judged.causes_variances_N_3[0].tolist(), strict=True)),
            bald=float(judged.bald_N[0]),
            expected_error=float(self.judge.error(evidence)[0]),
            unlikeness=float(self.classifier.unlikeness(inputs_1_F)[0]),
            void=False,
            guarantee=Guaranteed.of(guarantee, scores_1_5) if guarantee else None,
            reenacted=reenacted,
        )
        return diagnosis, enactments

    def pair(self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray, register: bool = True) -> ObservedPair:
        """Return what is drawn of the clouds, with registrations from other starts; see :meth:`diagnose`."""
        observed, model = (
            cloud[generator("diagnosis", role).permutation(len(cloud))[: self.points]]
            for role, cloud in (("observed", observed), ("model", model))
        )
        starts_n = exp(generator("diagnosis", "starts").normal(size=(self.runs.starts, 6)) * self.runs.deviation_6())
        starts_n[0] = T_icp
        icp = icp_to(model, self.runs.icp)
        T_n, fitness_n, rmse_n = icp.register(observed, starts_n)
        if not register:
            T_n[:1], fitness_n[:1], rmse_n[:1] = icp.register(observed, starts_n[:1], max_iterations=0)
        T_back, points = inverse(T_n[0]), transform(T_n[0], observed)
        return ObservedPair(points, model, T_back, T_n @ T_back, fitness_n, rmse_n, axes=("diagnosis",))

    def measured(
        self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray, register: bool = True
    ) -> tuple[np.ndarray, Evidence, Reenacted, list[Enactment]]:
        """Return the features (F,) of the pair and other starts, what is read of the result, and its re-enactment."""
        pair = self.pair(observed, model, T_icp, register)
        surface = ModelSurface(pair.model)
        enactments = reenact(pair, self.reenactment, self.truth, surface)
        row = row_of(enactments, pair, self.reenactment, self.truth)
        reenacted = Reenacted.of(enactments, row["weight"][: len(enactments)], T_icp, surface)
        # A partial target has open ends, too. But of 56 right results that lacked 30 % of it, none had a wrong scale;
        # with open ends, four more would be called free in some direction.
        reenacted = reenacted.with_fit(observed, T_icp, surface, open_ends=False)
        errors = surface.errors_up_to_symmetry if surface.symmetric else enactments[0].errors
        distance_K = errors(T_icp @ inverses(row["T_model_observed"]))
        evidence = Evidence(distance_K[None], row["weight"][None], pair.inlier_rmse_n[:1], pair.fitness_n[:1])
        return reenactment_features(Reenactments.of_rows([row], self.truth))[0], evidence, reenacted, enactments

    def state(self) -> dict[str, object]:
        """Return arrays, numbers and names for :meth:`from_state`."""
        return {
            "reads": READS,
            "classifier": self.classifier.state(),
            "start_threshold": self.start_threshold,
            "judge": self.judge.state(),
            "levels": [level.state() for level in self.levels],
            "points": self.points,
            "runs": {name: value for name, value in asdict(self.runs).items() if name != "icp"},
            "icp": asdict(self.runs.icp),
            "moved": self.moved,
            "reenactment": asdict(self.reenactment),
            "held_out": dict(self.held_out),
        }

    @classmethod
    def from_state(cls, state: Mapping) -> Diagnoser:
        """Return the diagnoser of a :meth:`state`."""
        return cls(
            classifier=PairClassifier.from_state(state["classifier"]),
            start_threshold=state["start_threshold"],
            judge=ResultJudge.from_state(state["judge"]),
            levels=tuple(map(Calibrated.from_state, state["levels"])),
            points=state["points"],
            runs=UncertaintySettings(**state["runs"], icp=ICPSettings(**state["icp"])),
            moved=state["moved"],
            reenactment=ReenactmentSettings(**state["reenactment"]),
            held_out=state["held_out"],
        )


def upgraded(state: Mapping[str, Any]) -> dict[str, Any]:
    """Return a state of the format before 6: it tells no result from its start, so that its judge is untrained."""
    kept = {name: part for name, part in state.items() if name not in ("error_weights", "threshold", "guarantee")}
    judge, levels = ResultJudge.untrained().state(), [level.state() for level in UNCALIBRATED]
    return kept | {"start_threshold": state["threshold"], "judge": judge, "levels": levels}


@dataclass(frozen=True)
class TrainingSet(Evidence):
    """N registrations with measured causes, and what is read of their results."""

    features_N_F: np.ndarray = array("N F")  # :func:`gpca.reenactment.dataset.reenactment_features`
    label_N: np.ndarray = array("N")  # nominal, a dominant cause, or borderline: by the mean error over the starts
    dominant_N: np.ndarray = array("N")  # the concept that adds most to that error, in any state
    causes_N_3: np.ndarray = array("N 3")  # whether each concept is a cause
    shown_error_N: np.ndarray = array("N")  # of the registration itself, diameters
    family_N: np.ndarray = array("N")  # family of the shape

    @classmethod
    def of(cls, causes: Causes, reenactments: Reenactments) -> TrainingSet:
        """Return the training set of one source."""
        truth = causes.truth
        return cls(
            features_N_F=reenactment_features(reenactments),
            label_N=labels_of(truth),
            dominant_N=truth.dominant,
            causes_N_3=truth.causes,
            shown_error_N=causes.error_shown,
            family_N=causes.registrations.cluster,
            distance_N_K=reenactments.result_error,
            weight_N_K=reenactments.weight,
            inlier_rmse_N=causes.registrations.inlier_rmse,
            fitness_N=causes.registrations.fitness,
        )

    def judge(self) -> ResultJudge:
        """Return a judge that learned from the results."""
        return ResultJudge.fit(self, self.shown_error_N, self.features_N_F[:, -DESCRIPTORS:])

    def probabilities(self, judge: ResultJudge, tolerance: float) -> np.ndarray:
        """Return the probabilities (N,) of the results to be off by more than a tolerance."""
        return judge.probability(self, tolerance, self.features_N_F[:, -DESCRIPTORS:])

    def states_within(self, tolerance: float) -> np.ndarray:
        """Return the states (N,) of the results; ``borderline`` where too little shape holds a failed one."""
        several_N = self.causes_N_3.sum(axis=1) > 1
        good_N, free_N = self.shown_error_N <= tolerance, self.dominant_N == GEOMETRY
        return np.select([good_N, free_N, several_N], [NOMINAL, BORDERLINE, SEVERAL], self.dominant_N)

    def classifier(self, gpc: GPCSettings, *axes: object) -> PairClassifier:
        """Train a classifier."""
        made = PairClassifier(gpc, *axes, trees=True)
        return made.fit(self.features_N_F, self.label_N != NOMINAL, self.causes_N_3)

    def folds(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield rows for training and rows of other families; an InputError if there is a single family."""
        from sklearn.model_selection import GroupKFold

        if (families := len(np.unique(self.family_N))) < 2:
            raise InputError("model", "learns from objects of a single family", "add a source of others")
        yield from GroupKFold(min(FOLDS, families)).split(self.label_N, groups=self.family_N)


def learn(
    training: TrainingSet,
    gpc: GPCSettings,
    causes: CauseSettings,
    reenactment: ReenactmentSettings,
    false_alarms: float,
    *axes: object,
) -> tuple[Diagnoser, np.ndarray, dict[float, np.ndarray]]:
    """Return the diagnoser, and of unseen families the BALD of failures and the probabilities of results to be off."""
    judged, result_T_N = judged_unseen(training, gpc, *axes)
    clear_N, nominal_N = training.label_N != BORDERLINE, training.label_N == NOMINAL
    start_threshold = threshold_of(judged.failure_N[nominal_N], false_alarms)
    levels = [
        calibrated(training, judged, result_N, tolerance, false_alarms)
        for tolerance, result_N in zip(TOLERANCES, result_T_N, strict=True)
        if (training.shown_error_N <= tolerance).any()
    ]
    diagnoser = Diagnoser(
        classifier=training.subset(clear_N).classifier(gpc, *axes),
        start_threshold=start_threshold,
        judge=training.judge(),
        levels=tuple(levels) or UNCALIBRATED,
        points=min(causes.points[1], MOST_REENACTED),
        runs=causes.runs(),
        moved=causes.moved,
        reenactment=reenactment,
        held_out=measured(training.subset(clear_N), judged.subset(clear_N), start_threshold),
    )
    return diagnoser, judged.bald_N[clear_N & ~nominal_N], dict(zip(TOLERANCES, result_T_N, strict=True))


def judged_unseen(training: TrainingSet, gpc: GPCSettings, *axes: object) -> tuple[Judgment, np.ndarray]:
    """Judge registrations by classifiers of other families: start and causes, and results (T, N) at `TOLERANCES`."""
    parts, rows = [], []
    result_T_N = np.full((len(TOLERANCES), len(training)), np.nan)
    for fold, (seen, unseen) in enumerate(training.folds()):
        learned, asked = training.subset(seen), training.subset(unseen)
        clear = learned.subset(learned.label_N != BORDERLINE)
        classifier = clear.classifier(gpc, *axes, "calibration", fold)
        parts.append(classifier.judge(classifier.normalized(asked.features_N_F)))
        rows.append(unseen)
        judge = learned.judge()
        result_T_N[:, unseen] = [asked.probabilities(judge, tolerance) for tolerance in TOLERANCES]
    return Judgment.joined(parts).subset(np.argsort(np.concatenate(rows))), result_T_N


def calibrated(
    training: TrainingSet, judged: Judgment, result_N: np.ndarray, tolerance: float, false_alarms: float
) -> Calibrated:
    """Calibrate threshold, alarm and sets of results at a tolerance, by judgments of unseen families."""
    state_N = training.states_within(tolerance)
    scores_N_5 = state_probabilities(judged.causes_N_3, result_N)
    family_N = training.family_N if highest_level(training.family_N) >= LEVEL else None
    by_family, single = (
        calibrate(scores_N_5, state_N, families, level=LEVEL, missed=MISSED, false_alarms=false_alarms)
        for families in (family_N, None)
    )
    guarantee = Guarantee(by_family.state_sets, single.failure_alarm, by_family.samples, by_family.families)
    threshold = guarantee.within(threshold_of(result_N[state_N == NOMINAL], false_alarms))
    held_out = alarms(training.shown_error_N > tolerance, result_N, threshold, training.family_N)
    return Calibrated(tolerance, threshold, guarantee, held_out=held_out)


def measured(training: TrainingSet, judged: Judgment, threshold: float) -> dict[str, float]:
    """Measures of accuracy (docs/causes.md) by the mean error over the starts, for the card of the model."""
    failed_N = training.label_N != NOMINAL
    scores_N_4 = np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])
    right_N = np.array(LABELS)[scores_N_4.argmax(axis=1)] == training.label_N
    present = [label for label in LABELS if (training.label_N == label).any()]
    first_N = np.array(LABELS[1:])[judged.causes_N_3.argmax(axis=1)]
    return {
        "balanced_accuracy": float(np.mean([right_N[training.label_N == label].mean() for label in present])),
        "dominant_accuracy": float((first_N == training.label_N)[failed_N].mean()) if failed_N.any() else 0.0,
        **alarms(failed_N, judged.failure_N, threshold, training.family_N),
    }


def alarms(failed_N: np.ndarray, probability_N: np.ndarray, threshold: float, family_N: np.ndarray) -> dict[str, float]:
    """Return how well a probability tells failures, and what an alarm gets wrong, with 95 % intervals over families."""
    from gpca.causes.judged import ranking

    weights_B_N = np.vstack([np.ones(len(family_N)), pigeonhole_weights(generator("held out"), family_N)])
    alarm_N = probability_N >= threshold
    estimates = {"auroc_failed": interval(ranking(probability_N, failed_N, weights_B_N)["area"])}
    for name, wrong_N, among_N in (("false_alarms", alarm_N, ~failed_N), ("missed", ~alarm_N, failed_N)):
        weights_B_n = weights_B_N[:, among_N]
        estimates[name] = interval(weighted_mean(wrong_N[among_N], weights_B_n), weights_B_n[1:])
    counts = {"samples": len(family_N), "good": (~failed_N).sum(), "families": len(np.unique(family_N))}
    values = {name + end: x for name, part in estimates.items() for end, x in zip(("", *ENDS), part, strict=True)}
    return {name: float(value) for name, value in (counts | values).items() if np.isfinite(value)}


def threshold_of(failure_N: np.ndarray, false_alarms: float) -> float:
    """Return the smallest probability of failure that at most the share `false_alarms` of nominal samples reaches."""
    if not len(failure_N):
        raise InputError("model", "has no nominal registration", "raise causes.train or causes.shares.nominal")
    return float(np.nextafter(np.quantile(failure_N, 1 - false_alarms, method="inverted_cdf"), 1))
