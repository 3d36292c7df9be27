"""Adam as torch computes it (Kingma and Ba 2015), and the one-cycle schedule, without torch's classes around them.

Making an object of those classes loads torch's compiler, which nothing here uses: 1.2 to 1.7 s in every process that
trains an encoder or fits a classifier, more than most fits take.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import torch
from torch.optim.adam import adam

RISING = 0.25  # share of the steps in which the learning rate of one cycle rises
START, END = 25.0, 1e4  # its peak in multiples of the first learning rate, and that in multiples of the last
MOST, LEAST = 0.95, 0.85  # β₁ at the ends of a cycle, and at its peak


class Adam:
    """The same steps to the bit as ``torch.optim.AdamW``, fused; without decay that is ``torch.optim.Adam``.

    Attributes:
        learning_rate, beta1: of the next step.
    """

    def __init__(self, parameters: Iterable[torch.Tensor], learning_rate: float, weight_decay: float = 0.0) -> None:
        self.learning_rate = learning_rate
        self.beta1 = 0.9
        self._weight_decay = weight_decay
        self._parameters = list(parameters)
        self._means = [torch.zeros_like(parameter) for parameter in self._parameters]
        self._squares = [torch.zeros_like(parameter) for parameter in self._parameters]
        self._steps = [torch.tensor(0.0) for _ in self._parameters]

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self._parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Move every parameter by its gradient, which each must have."""
        adam(
            self._parameters,
            [parameter.grad for parameter in self._parameters if parameter.grad is not None],
            self._means,
            self._squares,
            [],
            self._steps,
            decoupled_weight_decay=True,
            amsgrad=False,
            beta1=self.beta1,
            beta2=0.999,
            lr=self.learning_rate,
            weight_decay=self._weight_decay,
            eps=1e-8,
            maximize=False,
            fused=True,  # its own loop; without it torch.sqrt, whose last bit depends on the processor's vendor
        )

    def state_dict(self) -> dict[str, list[torch.Tensor]]:
        """Return what the next steps depend on, but for the learning rate and β₁."""
        return {"means": self._means, "squares": self._squares, "steps": self._steps}

    def load_state_dict(self, state: Mapping[str, list[torch.Tensor]]) -> None:
        """Continue from a :meth:`state_dict`."""
        for name, own in self.state_dict().items():
            for tensor, loaded in zip(own, state[name], strict=True):
                tensor.copy_(loaded)


class OneCycle:
    """The learning rate and β₁ of one cycle (Smith and Topin 2018) as ``torch.optim.lr_scheduler.OneCycleLR`` has them.

    Args:
        optimiser: whose learning rate and β₁ it sets, for the first step at once.
        peak: the largest learning rate.
        steps: of the cycle, 5 or more: of 4 steps a quarter is one, a rise of no length.
    """

    def __init__(self, optimiser: Adam, peak: float, steps: int) -> None:
        self._optimiser = optimiser
        first = peak / START
        turn, end = RISING * steps - 1, steps - 1
        self._rise = (0.0, turn, (first, peak), (MOST, LEAST))
        self._fall = (turn, end, (peak, first / END), (LEAST, MOST))
        self._set(0)

    def step(self) -> None:
        """Set what the next step takes."""
        self._set(self._done + 1)

    def _set(self, done: int) -> None:
        self._done = done
        start, end, rates, betas = self._rise if done <= self._rise[1] else self._fall
        share = (done - start) / (end - start)
        self._optimiser.learning_rate, self._optimiser.beta1 = _anneal(*rates, share), _anneal(*betas, share)

    def state_dict(self) -> dict[str, int]:
        """Return how many steps were made."""
        return {"done": self._done}

    def load_state_dict(self, state: Mapping[str, int]) -> None:
        """Continue from a :meth:`state_dict`."""
        self._set(state["done"])


def _anneal(start: float, end: float, share: float) -> float:
    """Return the value at a share of the way between two, along a cosine."""
    return end + (start - end) / 2.0 * (math.cos(math.pi * share) + 1)
