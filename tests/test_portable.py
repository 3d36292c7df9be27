import subprocess
import sys

import pytest
import torch

from gpca.portable import Adam, log_sum_exp, logarithm, square_root
from gpca.process.code_files import ROOT


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(("own", "theirs"), [(square_root, torch.sqrt), (logarithm, torch.log)])
def test_values_and_slopes_are_torchs_within_rounding(own, theirs, dtype):
    outcomes = []
    for function in (own, theirs):
        positive = torch.logspace(-15, 15, 1001, dtype=dtype, requires_grad=True)
        values = function(positive)
        [slopes] = torch.autograd.grad(values.sum(), positive)
        outcomes.append((values.detach(), slopes))
    for ours, torchs in zip(*outcomes, strict=True):
        torch.testing.assert_close(ours, torchs, rtol=4 * torch.finfo(dtype).eps, atol=0)


def test_a_sum_of_exponentials_is_torchs_within_rounding():
    values_N_C = torch.tensor([[1e3, 1e3, -1e3], [-1e3, -1e3, -1e3], [0.0, 1.0, 2.0]], dtype=torch.float64)
    torch.testing.assert_close(log_sum_exp(values_N_C), values_N_C.logsumexp(dim=1), rtol=1e-15, atol=0)


def fitted(make, dtype):
    torch.manual_seed(0)
    weights = [torch.randn(5, 3, dtype=dtype, requires_grad=True), torch.randn(3, dtype=dtype, requires_grad=True)]
    optimizer = make(weights)
    for _ in range(25):
        optimizer.zero_grad()
        (weights[0] @ weights[1] - 1).square().sum().backward()
        optimizer.step()
    return weights


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_steps_are_those_of_torch_to_the_bit(dtype):
    ours = fitted(lambda weights: Adam(weights, 0.1), dtype)
    theirs = fitted(lambda weights: torch.optim.Adam(weights, lr=0.1, fused=True), dtype)
    assert all(torch.equal(*pair) for pair in zip(ours, theirs, strict=True))


def test_torchs_compiler_is_not_loaded():
    code = """import sys, numpy as np
from gpca.classifier.gpc import GPC, GPCSettings
settings = GPCSettings(iterations=2, inducing=2, draws=4)
GPC(('a', 'b'), settings, 0).fit(np.arange(8.0).reshape(4, 2), np.array(['a', 'b'] * 2))
print('torch._dynamo' in sys.modules)"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
