"""The guard notes what a vendor defines, and nothing else."""

import re

import pytest
import torch

from gpca.process.code_files import ROOT

from .vendor_guard import VendorGuard

SQUARE = torch.eye(3) + 0.1
DEFINED = {
    "sqrt of torch.float32": lambda: SQUARE.sqrt(),
    "sqrt_ of torch.float64": lambda: SQUARE.double().sqrt_(),
    "pow of torch.float32": lambda: SQUARE**0.5,
    "_foreach_sqrt of torch.float32": lambda: torch._foreach_sqrt([SQUARE]),
    "_cdist_forward of torch.float32": lambda: torch.cdist(SQUARE, SQUARE),
    "linalg_cholesky_ex of torch.float32": lambda: torch.linalg.cholesky(SQUARE),
    "linalg_lstsq of torch.float64": lambda: torch.linalg.lstsq(SQUARE.double(), SQUARE.double()),
    "log of torch.float64": lambda: SQUARE.double().log(),
}


@pytest.mark.parametrize("call", DEFINED)
def test_a_call_that_the_vendor_defines_is_noted(call):
    with VendorGuard() as guard:
        DEFINED[call]()
    assert guard.calls == {call}


def test_a_step_of_torchs_own_adam_is_noted_and_what_ieee_defines_is_not():
    for fused, noted in ((False, True), (True, False)):
        weights = torch.ones(3, requires_grad=True)
        optimizer = torch.optim.Adam([weights], fused=fused)
        weights.sum().backward()
        with VendorGuard() as guard:
            optimizer.step()
        assert bool(guard.calls) == noted
    with VendorGuard() as guard:
        torch.linalg.cholesky(SQUARE.double())
        SQUARE.rsqrt().reciprocal().log().square().exp().pow(2).norm().reciprocal()
        torch.empty(0).sum()
        torch.cat([SQUARE, SQUARE])
    assert guard.calls == set()


def test_no_compiled_loop_may_take_an_estimate_for_a_quotient_or_a_root():
    """LLVM does so where ``fastmath`` allows reciprocals (``arcp``) or approximate functions (``afn``)."""
    options = {
        str(path.relative_to(ROOT)): re.findall(r"""fastmath["']?\s*[:=]\s*(\{[^}]*\}|\w+)""", path.read_text())
        for folder in ("gpca", "baselines")
        for path in sorted((ROOT / folder).rglob("*.py"))
    }
    flags = {flag for found in options.values() for option in found for flag in re.findall(r"\w+", option)}
    assert flags == {"contract", "nsz", "nnan", "reassoc"}
