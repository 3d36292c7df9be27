"""Functions of torch with the same bits on every vendor's processors, and Adam without torch's class around it.

For its own functions torch calls MKL, which starts some of them with an estimate (``rsqrtps``, ``rcpps``) from a table
of each vendor; ``tests/vendor_guard.py`` lists these functions.
"""

import math
from collections.abc import Iterable, Mapping

import torch
from torch import Tensor
from torch.optim.adam import adam


def square_root(positive: Tensor) -> Tensor:
    """Return the square root of positive numbers within an ulp, in place of ``torch.sqrt``."""
    # torch computes rsqrt by the root and the quotient of IEEE 754.
    return positive.rsqrt().reciprocal()


def logarithm(positive: Tensor) -> Tensor:
    """Return the natural logarithm, in place of ``torch.log`` in double precision."""
    # torch computes xlogy by the C library's logarithm.
    return positive.new_ones(()).xlogy(positive)


class Adam:
    """Adam or AdamW with the bits of torch's fused classes, whose objects load torch's compiler for 1.2 to 4 s."""

    def __init__(self, parameters: Iterable[Tensor], learning_rate: float, weight_decay: float = 0.0) -> None:
        self.learning_rate, self.beta1, self._weight_decay = learning_rate, 0.9, weight_decay
        self._parameters = list(parameters)
        self._means = [torch.zeros_like(parameter) for parameter in self._parameters]
        self._squares = [torch.zeros_like(parameter) for parameter in self._parameters]
        self._steps = [torch.zeros((), device=parameter.device) for parameter in self._parameters]

    def zero_grad(self) -> None:
        """Reset the gradients."""
        for parameter in self._parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Update every parameter that has a gradient."""
        states = zip(self._parameters, self._means, self._squares, self._steps, strict=True)
        rows = [(p, p.grad, mean, square, step) for p, mean, square, step in states if p.grad is not None]
        parameters, gradients, means, squares, steps = map(list, zip(*rows, strict=True))
        adam(
            parameters,
            gradients,
            means,
            squares,
            [],
            steps,
            amsgrad=False,
            beta1=self.beta1,
            beta2=0.999,
            lr=self.learning_rate,
            weight_decay=self._weight_decay,
            eps=1e-8,
            maximize=False,
            fused=True,  # the other loop calls torch.sqrt, whose last bit depends on the processor's vendor
            decoupled_weight_decay=True,
        )

    def state_dict(self) -> dict[str, list[Tensor]]:
        """State of the moments, for a checkpoint between two steps."""
        return {"means": self._means, "squares": self._squares, "steps": self._steps}

    def load_state_dict(self, state: Mapping[str, list[Tensor]]) -> None:
        """Continue from a checkpoint."""
        for name, own in self.state_dict().items():
            for tensor, saved in zip(own, state[name], strict=True):
                tensor.copy_(saved)


def one_cycle(step: int, steps: int, peak: float, rising: float) -> tuple[float, float]:
    """Learning rate and `beta1` of a step of the one-cycle policy (Smith and Topin 2019), with the bits of torch's."""
    top, lowest = rising * steps - 1, peak / 25
    if step <= top:
        share = step / top
        return _annealed(lowest, peak, share), _annealed(0.95, 0.85, share)
    share = (step - top) / (steps - 1 - top)
    return _annealed(peak, lowest / 1e4, share), _annealed(0.85, 0.95, share)


def _annealed(start: float, end: float, share: float) -> float:
    return end + (start - end) / 2 * (math.cos(math.pi * share) + 1)
