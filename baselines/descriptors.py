"""Explainers of causes on the descriptors of a pair, or on its re-enactment (docs/causes.md)."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from baselines.gates import Alarm
from baselines.pair import CLOUDS, WITH_RUNS
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import EVERY, EVERYTHING, QUICK, RESIDUALS, Columns, seen
from gpca.causes.settings import DENSITIES
from gpca.causes.truth import NOMINAL
from gpca.classifier.settings import GPCArguments, LearningRate
from gpca.explainers import interface
from gpca.explainers.classifiers import boosted_trees, standardized_regression
from gpca.explainers.gpca import DescriptorGPCA
from gpca.explainers.interface import ExplainerEntry, Sees, attached
from gpca.model.result import DEFAULT_TOLERANCE, Evidence, ResultJudge
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import ENTROPY
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

ALL: Sees = (*WITH_RUNS, "remedies")
REENACTMENT: Sees = (*WITH_RUNS, "reenactment")
WITHOUT = "clouds alone"  # in titles: no motion of ICP, no further runs, no remedies
LEAST = 1e-9  # of a score, so that their sum is not 0
JOINT_AND_APART = [row for row, name in enumerate(ENTROPY) if name.startswith(("joint", "apart"))]


def described(registrations: Registrations, sees: Sees, wanted: Columns = EVERYTHING) -> np.ndarray:
    """Return the attached descriptors (:func:`gpca.causes.descriptors.seen`), or the numbers of the re-enactment."""
    if "reenactment" in sees:
        return attached(registrations, "reenactment")
    return seen({group: attached(registrations, group) for group in wanted}, sees, wanted)


class Learner(interface.ClassifierExplainer):
    """Probabilities of an unfitted scikit-learn classifier on the `wanted` columns of the parts it sees."""

    labels = LABELS

    def __init__(self, classifier, sees: Sees, wanted: Columns = EVERYTHING) -> None:
        super().__init__(classifier)
        self._sees, self._wanted = sees, wanted

    def features(self, registrations: Registrations) -> np.ndarray:
        return described(registrations, self._sees, self._wanted)


def regression(wanted: Columns, sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> Learner:
    return Learner(standardized_regression(inverse_regularisation), sees, wanted)


def randomized_trees(source: str, seed: int, trees: int = 300):
    """Return an unfitted forest of extremely randomized trees (Geurts et al. 2006)."""
    from sklearn.ensemble import ExtraTreesClassifier

    random_state = seed_of(source, seed, "randomised trees") % 2**32
    return ExtraTreesClassifier(trees, min_samples_leaf=2, max_features=0.3, random_state=random_state)


def forest(wanted: Columns, sees: Sees, source: str, seed: int, trees: Count = 300) -> Learner:
    return Learner(randomized_trees(source, seed, trees), sees, wanted)


def boosting(
    sees: Sees, source: str, seed: int, iterations: Count = 150, learning_rate: LearningRate = 0.06
) -> Learner:
    return Learner(boosted_trees(source, seed, iterations=iterations, learning_rate=learning_rate), sees)


class CausePairGPCA(DescriptorGPCA):
    """GP-CA on the `wanted` columns of the parts that it sees."""

    labels = LABELS

    def __init__(self, wanted: Columns, sees: Sees, source: str, seed: int, **settings: GPCArguments) -> None:
        axes = (source, seed, "reenactment" if "reenactment" in sees else "causes")
        super().__init__(axes, source, seed, **settings)
        self._sees, self._wanted = sees, wanted

    def features(self, registrations: Registrations) -> np.ndarray:
        return described(registrations, self._sees, self._wanted)


class Committee(interface.ScoringExplainer):
    """The mean of three explainers of different kinds, whose errors differ."""

    labels = LABELS

    def __init__(self, wanted: Columns, sees: Sees, source: str, seed: int) -> None:
        self._members: list[interface.ConceptExplainer] = [
            Learner(randomized_trees(source, seed), sees, wanted),
            Learner(boosted_trees(source, seed), sees, wanted),
            CausePairGPCA(wanted, sees, source, seed, learning_rate=0.1, iterations=200),
        ]

    def fit(self, registrations: Registrations) -> None:
        for member in self._members:
            member.fit(registrations)

    def scores(self, registrations: Registrations) -> np.ndarray:
        return np.mean([member.explain(registrations).scores_N_C for member in self._members], axis=0)


class Reenact(interface.ScoringExplainer):
    """Scores are the probabilities of the re-enactment itself (:mod:`gpca.reenactment.dataset`)."""

    labels = LABELS

    def scores(self, registrations: Registrations) -> np.ndarray:
        return attached(registrations, "verdict")


class OfFailed(interface.ScoringExplainer):
    """An explainer of causes that is asked about failures alone: its scores of the concepts."""

    def __init__(self, make: Callable[..., interface.ConceptExplainer], source: str, seed: int) -> None:
        self._explainer = make(source, seed)

    def fit(self, registrations: Registrations) -> None:
        self._explainer.fit(registrations)

    def scores(self, registrations: Registrations) -> np.ndarray:
        scores_N_3 = self._explainer.explain(registrations).scores_N_C[:, 1:] + LEAST
        return scores_N_3 / scores_N_3.sum(axis=1, keepdims=True)


class AlignmentClassifier(Alarm):
    """Probability of a failure by an unfitted scikit-learn classifier on the `wanted` columns of the parts it sees."""

    def __init__(self, classifier, sees: Sees, wanted: Columns = EVERYTHING) -> None:
        self._classifier, self._sees, self._wanted = classifier, sees, wanted

    def fit(self, registrations: Registrations) -> None:
        """Learn from labeled registrations; if all are nominal, or all failed, predict the same for all."""
        failed_N = registrations.concept != NOMINAL
        self._failures = float(failed_N.mean())
        if 0 < self._failures < 1:
            self._classifier.fit(described(registrations, self._sees, self._wanted), failed_N)

    def scores(self, registrations: Registrations) -> np.ndarray:
        if self._failures in (0, 1):
            return even_scores(np.full(len(registrations), self._failures))
        features_N_F = described(registrations, self._sees, self._wanted)
        return even_scores(self._classifier.predict_proba(features_N_F)[:, 1])


class Result(Alarm):
    """The judge of `gpca explain`: the probability that the registration itself is off by more than the tolerance."""

    def fit(self, registrations: Registrations) -> None:
        self._judge = ResultJudge.fit(self._evidence(registrations), attached(registrations, "error_shown"))

    def scores(self, registrations: Registrations) -> np.ndarray:
        return even_scores(self._judge.probability(self._evidence(registrations), DEFAULT_TOLERANCE))

    def _evidence(self, registrations: Registrations) -> Evidence:
        error_N_K, weight_N_K = attached(registrations, "result_error"), attached(registrations, "weight")
        return Evidence(error_N_K, weight_N_K, registrations.inlier_rmse, registrations.fitness)


def even_scores(failure_N: np.ndarray) -> np.ndarray:
    """Return scores (N, 4) with sum one; at a failure probability of 0.5, each cause equals nominal."""
    scores_N_4 = np.column_stack([1 - failure_N, *(failure_N for _ in CONCEPTS)])
    return scores_N_4 / scores_N_4.sum(axis=1, keepdims=True)


def alarm_entropies(sees: Sees, source: str, seed: int, inverse_regularisation: Positive = 1.0) -> AlignmentClassifier:
    """Return CorAl (Adolfsson et al. 2021), a regression on the mean entropies of the clouds, joint and apart."""
    return AlignmentClassifier(standardized_regression(inverse_regularisation), sees, {"entropy": JOINT_AND_APART})


def alarm_features(sees: Sees, source: str, seed: int, iterations: Count = 150) -> AlignmentClassifier:
    """Return boosted trees on features like FACT's (Dillén, Forssén & Edstedt 2025), in place of its network."""
    return AlignmentClassifier(boosted_trees(source, seed, "alignment", iterations=iterations), sees)


def entry(title: str, make: Callable[..., interface.ConceptExplainer], sees: Sees) -> ExplainerEntry:
    """Return the entry of an explainer whose first argument is what it sees."""
    return ExplainerEntry(title, partial(make, sees), sees, reads="descriptors")


LEVELS: dict[str, Sees] = {
    "source": ("source",),
    "pair": CLOUDS,
    "motion": ("pair", "motion"),
    "runs": WITH_RUNS,
    "quick_remedies": ("pair", "motion", "quick_remedies"),
    "everything": ALL,
}
# Residuals at several scales, in both directions, and the spread. Quantiles of the distances are residuals of trimmed
# pairs, so they do not depend on the overlap.
_residuals = partial(regression, RESIDUALS)
# Spacings and numbers of points: the shortcut that a fixed draw of points opens.
_density = partial(regression, {"planes": DENSITIES})
_distances = partial(forest, {"distances": EVERY, "motion": EVERY})


_gpca, _committee = partial(CausePairGPCA, EVERYTHING), partial(Committee, EVERYTHING)
_quick = dict.fromkeys(QUICK, EVERY)  # descriptors that further samples have


def _further(title: str, make: Callable[..., interface.ConceptExplainer]) -> ExplainerEntry:
    return replace(entry(title, partial(make, _quick), WITH_RUNS), further=True)


_reenacted = partial(ExplainerEntry, sees=REENACTMENT, reads=interface.REENACTED)
_reenact_committee = partial(_committee, REENACTMENT)
EXPLAINERS = {  # of the hard samples, all of which failed
    "reenact": _reenacted("Re-enactment (untrained)", partial(OfFailed, Reenact)),
    "reenact_committee": _reenacted("Committee on the re-enactment", partial(OfFailed, _reenact_committee)),
}
CAUSE_EXPLAINERS = {
    "alarm_entropies": entry("Aligned or not by entropies, CorAl", alarm_entropies, CLOUDS),
    "alarm_features": entry("Aligned or not by local features, after FACT", alarm_features, CLOUDS),
    "residuals": entry("Residuals (regression)", _residuals, WITH_RUNS),
    "residuals_clouds": entry(f"Residuals (regression), {WITHOUT}", _residuals, CLOUDS),
    "density": entry("Density alone (control)", _density, CLOUDS),
    "entropies": entry("Entropies, CorAl (regression)", partial(regression, {"entropy": EVERY}), CLOUDS),
    "pair_forest": entry("Distances of the pair (forest)", _distances, WITH_RUNS),
    "pair_forest_clouds": entry(f"Distances of the pair (forest), {WITHOUT}", _distances, CLOUDS),
    "pair_boosting": entry("All descriptors (boosting)", boosting, ALL),
    "pair_boosting_clouds": entry(f"Descriptors (boosting), {WITHOUT}", boosting, CLOUDS),
    "gpca_pair": entry("GP-CA on the pair", _gpca, ALL),
    "gpca_pair_clouds": entry(f"GP-CA on the pair, {WITHOUT}", _gpca, CLOUDS),
    "gpca_further": _further("GP-CA on the pair, further samples", CausePairGPCA),
    "committee_further": _further("Committee on the pair, further samples", Committee),
    "pair_committee": entry("Committee on the pair", _committee, ALL),
    "pair_committee_clouds": entry(f"Committee on the pair, {WITHOUT}", _committee, CLOUDS),
    "reenact": _reenacted("Re-enactment (untrained)", Reenact),
    "result": _reenacted("Judge of the result, as gpca explain", Result),
    "reenact_committee": _reenacted("Committee on the re-enactment", _reenact_committee),
}
for level, sight in LEVELS.items():
    words = interface.in_words(sight)
    CAUSE_EXPLAINERS[f"trees_on_{level}"] = entry(f"Forest on {words}", partial(forest, EVERYTHING), sight)
    CAUSE_EXPLAINERS[f"gpca_on_{level}"] = entry(f"GP-CA's classifier on {words}", _gpca, sight)
