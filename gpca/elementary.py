"""Elementary functions of tensors, with the same bits on every vendor's processors.

For their own functions torch asks MKL, which begins some of them with an estimate (``rsqrtps``, ``rcpps``) that each
vendor's processors take from a table of their own. ``tests/vendor_guard.py`` lists these functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor


def square_root(positive: Tensor) -> Tensor:
    """Return the square root of positive numbers, in the place of ``torch.sqrt``; it is within an ulp."""
    # torch computes rsqrt by the root and the quotient that IEEE 754 defines.
    return positive.rsqrt().reciprocal()


def logarithm(positive: Tensor) -> Tensor:
    """Return the natural logarithm, in the place of ``torch.log`` in double precision."""
    # torch computes xlogy by the C library's logarithm.
    return positive.new_ones(()).xlogy(positive)


def log_sum_exp(values_N_C: Tensor) -> Tensor:
    """Return the logarithm of the sum of the exponentials of each row, in the place of ``torch.logsumexp``."""
    largest_N = values_N_C.detach().amax(dim=1)
    return largest_N + logarithm((values_N_C - largest_N[:, None]).exp().sum(dim=1))
