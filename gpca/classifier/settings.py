"""Settings of the Gaussian process classifier, without loading torch."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from gpca.settings import ArgumentsOf, Bounds, Count

Kernel = Literal["rbf", "matern32", "polynomial"]
LearningRate = Annotated[float, Bounds(exclusiveMinimum=0, maximum=10)]
Draws = Annotated[int, Bounds(minimum=2)]


@dataclass(frozen=True)
class GPCSettings:
    """Settings of the classifier and its fit; the defaults are the paper's."""

    kernel: Kernel = "rbf"  # ``rbf``, ``matern32`` or ``polynomial`` (of degree 2)
    learning_rate: LearningRate = 0.01  # of Adam
    iterations: Count = 100  # of Adam, on the ELBO of the whole training set
    inducing: Count = 64  # number of shared inducing inputs N_Z
    draws: Draws = 1000  # M, posterior draws per explanation


GPCArguments = Annotated[Any, ArgumentsOf(GPCSettings)]  # keyword arguments passed on to it
