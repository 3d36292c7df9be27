"""Trivial opponents: a few numbers of a registration with thresholds or weights fitted in training."""

from collections.abc import Callable
from functools import partial

import numpy as np

from baselines.descriptors import REENACTMENT
from baselines.pair import WITH_MOTION, WITH_RUNS
from baselines.untrained import GatedRule, Rule
from gpca.explainers.classifiers import standardized_regression
from gpca.explainers.interface import REENACTED, ClassifierExplainer, ExplainerEntry, attached, for_causes, measured
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.trivial import TRIVIAL, trivial_numbers_of
from gpca.seeds import seed_of
from gpca.settings import Count, Positive

LEVELS = 40  # quantiles of the training samples that are tried as a constant
HYPOTHESIS = ("noise", "outliers", "missing", "to_start", "to_result")  # of what is measured under the best hypothesis
OBSERVED, MODEL = (
    [TRIVIAL.index(f"log_{cloud}_{what}") for what in ("points", "extent")] for cloud in ("observed", "model")
)


class TrivialNumbers:
    """Base of explainers that read the ten trivial numbers."""

    def describe(self, registrations: Registrations) -> Registrations:
        return measured(registrations, "trivial_", lambda: {"numbers": trivial_numbers_of(registrations)})

    def features(self, registrations: Registrations) -> np.ndarray:
        return self.describe(registrations).attached["trivial_numbers"]


class TrivialClassifier(TrivialNumbers, ClassifierExplainer):
    """A scikit-learn classifier on the ten trivial numbers."""


class FittedRule(TrivialNumbers, Rule):
    """The rule of three lines with both constants, and points or extents as the second number, fitted in training."""

    def fit(self, registrations: Registrations) -> None:
        """Take the first constants with the best mean share named rightly of the concepts."""
        numbers, best = self._numbers(registrations), -1.0
        is_N_3 = registrations.concept[:, None] == np.array(CONCEPTS)
        weight_N_3 = is_N_3 / np.maximum(is_N_3.sum(axis=0), 1)
        turns, *shares = (np.quantile(number_N, np.linspace(0, 1, LEVELS)) for number_N in numbers)
        for which, of in enumerate(shares):
            for turn in turns:
                for share in of:
                    right = float((weight_N_3 * self.named(numbers[0] > turn, numbers[1 + which] < share)).sum())
                    if right > best:
                        best, self._constants = right, (turn, which, share)

    def scores(self, registrations: Registrations) -> np.ndarray:
        turn, which, share = self._constants
        numbers = self._numbers(registrations)
        return self.named(numbers[0] > turn, numbers[1 + which] < share)

    def _numbers(self, registrations: Registrations) -> list[np.ndarray]:
        """Return turns (N,), and the logarithms of both shares of the model that were observed."""
        numbers_N_F = self.features(registrations)
        return [numbers_N_F[:, 0], *(numbers_N_F[:, OBSERVED] - numbers_N_F[:, MODEL]).T]


class Hypotheses(ClassifierExplainer):
    """Thresholds on how the best hypothesis explains the pair: a tree of depth 3."""

    def features(self, registrations: Registrations) -> np.ndarray:
        from gpca.reenactment.dataset import FEATURES

        columns = [FEATURES.index(f"first_{name}") for name in HYPOTHESIS]
        return attached(registrations, "reenactment")[:, columns]


def tree(explainer: Callable, source: str, seed: int, depth: Count = 3) -> ClassifierExplainer:
    from sklearn.tree import DecisionTreeClassifier

    random_state = seed_of(source, seed, "trivial tree") % 2**32
    return explainer(DecisionTreeClassifier(max_depth=depth, min_samples_leaf=2, random_state=random_state))


def logistic(explainer: Callable, source: str, seed: int, inverse_regularisation: Positive = 1.0):
    return explainer(standardized_regression(inverse_regularisation))


def _entries(of: Callable[[type], type], rule: ExplainerEntry) -> dict[str, ExplainerEntry]:
    trivial = of(TrivialClassifier)
    return {
        "rule_fitted": rule,
        "tree_trivial": ExplainerEntry("Tree of depth 3 on ten trivial numbers", partial(tree, trivial), WITH_MOTION),
        "logistic_trivial": ExplainerEntry(
            "Logistic regression on ten trivial numbers", partial(logistic, trivial), WITH_MOTION
        ),
        "hypotheses": ExplainerEntry(
            "Hypotheses with thresholds, not enacted", partial(tree, of(Hypotheses)), REENACTMENT, reads=REENACTED
        ),
    }


EXPLAINERS = _entries(lambda explainer: explainer, ExplainerEntry("Rule, constants fitted", FittedRule, WITH_MOTION))
CAUSE_EXPLAINERS = _entries(
    for_causes,
    ExplainerEntry(
        "Rule, constants fitted, nominal by the best gate",
        partial(GatedRule, FittedRule),
        WITH_RUNS,
        reads="descriptors",
    ),
)
