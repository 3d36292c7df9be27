"""Adam as torch computes it (Kingma and Ba 2015), without torch's class around it, for fits that take seconds.

Making an object of that class loads torch's compiler, which no fit uses: 1.2 to 1.7 s in every process, more than most
fits take. An encoder trains for minutes and takes torch's own.
"""

from __future__ import annotations

from collections.abc import Iterable

import torch
from torch.optim.adam import adam


class Adam:
    """The same steps to the bit as ``torch.optim.Adam``, fused."""

    def __init__(self, parameters: Iterable[torch.Tensor], learning_rate: float) -> None:
        self._learning_rate = learning_rate
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
            amsgrad=False,
            beta1=0.9,
            beta2=0.999,
            lr=self._learning_rate,
            weight_decay=0.0,
            eps=1e-8,
            maximize=False,
            fused=True,  # its own loop; without it torch.sqrt, whose last bit depends on the processor's vendor
        )
