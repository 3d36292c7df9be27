"""Functions of torch with the same bits on every vendor's processors, and Adam without torch's class around it.

For its own functions torch calls MKL, which starts some of them with an estimate (``rsqrtps``, ``rcpps``) from a table
of each vendor; ``tests/vendor_guard.py`` lists these functions.
"""

from __future__ import annotations

from collections.abc import Iterable

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


def log_sum_exp(values_N_C: Tensor) -> Tensor:
    """Return the logarithm of the sum of the exponentials of each row, in place of ``torch.logsumexp``."""
    largest_N = values_N_C.detach().amax(dim=1)
    return largest_N + logarithm((values_N_C - largest_N[:, None]).exp().sum(dim=1))


class Adam:
    """Adam (Kingma and Ba 2015) with the bits of ``torch.optim.Adam``, fused, for fits that take seconds.

    An object of torch's class loads torch's compiler: 1.2 to 1.7 s in every process.
    """

    def __init__(self, parameters: Iterable[Tensor], learning_rate: float) -> None:
        self._learning_rate = learning_rate
        self._parameters = list(parameters)
        self._means = [torch.zeros_like(parameter) for parameter in self._parameters]
        self._squares = [torch.zeros_like(parameter) for parameter in self._parameters]
        self._steps = [torch.tensor(0.0) for _ in self._parameters]

    def zero_grad(self) -> None:
        """Reset the gradients."""
        for parameter in self._parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Update every parameter by its gradient, which each must have."""
        adam(
            self._parameters,
            [parameter.grad for parameter in self._parameters if parameter.grad is not None],
            self._means,
            self._squares,
            [],
            self._steps,
            amsgrad=False,
            beta1=0.9,
            beta2=0.999,
            lr=self._learning_rate,
            weight_decay=0.0,
            eps=1e-8,
            maximize=False,
            fused=True,  # the other loop calls torch.sqrt, whose last bit depends on the processor's vendor
        )
