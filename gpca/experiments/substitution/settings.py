"""The methods and estimators exchanged beneath the explainers, and the sizes: nothing here needs torch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from gpca.settings import Bounds, Count, Distinct

BALANCED = {"multipleOf": 3}  # over the concepts
METHOD, ESTIMATOR = "method", "estimator"  # the two exchanges
LABELS = ("exchanged", "learnt_from", "asked_of", "explainer")  # columns before those of a prediction file
FAILURE = "failure"  # the column behind them: why the method failed, or the estimator


@dataclass(frozen=True)
class ExchangeSettings:
    """The methods and estimators, and the numbers of registrations.

    Attributes:
        seeds: how many of the run's seeds are used, from the first.
        methods: registration methods, each used for training and for test registrations in turn.
        train, test: registrations of each source and seed, by each of them, at most.
        points: of source and of target that are registered, at most.
        estimators: of the covariance, each in the place of Monte-Carlo.
        estimated_train: training registrations whose covariance is estimated, and as many others from which estimators
            learn, at most.
        estimated_test: test registrations that are explained by their uncertainty, at most.
    """

    seeds: Count = 3
    methods: Distinct[str] = ("point_to_point", "point_to_plane")
    train: Annotated[int, Bounds(minimum=9, **BALANCED)] = 120
    test: Annotated[int, Bounds(minimum=3, **BALANCED)] = 60
    points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 512
    estimators: Distinct[str] = ("monte_carlo",)
    estimated_train: Annotated[int, Bounds(minimum=9, **BALANCED)] = 24
    estimated_test: Annotated[int, Bounds(minimum=3, **BALANCED)] = 9
