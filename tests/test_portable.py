import subprocess
import sys

import pytest
import torch

from gpca.portable import Adam, logarithm, one_cycle, square_root
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
@pytest.mark.parametrize("decay", [0.0, 0.01])
def test_steps_are_those_of_torch_to_the_bit(dtype, decay):
    ours = fitted(lambda weights: Adam(weights, 0.1, decay), dtype)
    theirs = fitted(lambda weights: torch.optim.AdamW(weights, lr=0.1, weight_decay=decay, fused=True), dtype)
    assert all(torch.equal(*pair) for pair in zip(ours, theirs, strict=True))


@pytest.mark.parametrize("steps", [5, 6, 100])
def test_one_cycle_is_torchs_to_the_bit(steps):
    optimizer = torch.optim.AdamW([torch.zeros(1, requires_grad=True)], 1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 1e-3, steps, pct_start=0.25)
    for step in range(steps + 1):
        [group] = optimizer.param_groups
        assert one_cycle(step, steps, 1e-3, 0.25) == (group["lr"], group["betas"][0])
        optimizer.step()
        if step < steps:
            schedule.step()


FITS = """
import sys, numpy as np
from baselines.heads import Heads
from gpca.classifier.gpc import GPC, GPCSettings
inputs = np.arange(8.0).reshape(4, 2)
GPC(("a", "b"), GPCSettings(iterations=2, inducing=2, draws=4), 0).fit(inputs, np.array(["a", "b"] * 2))
Heads(0, steps=2).fit(inputs, np.arange(4) % 2)
print("torch._dynamo" in sys.modules)
"""


def test_torchs_compiler_is_not_loaded():
    done = subprocess.run([sys.executable, "-c", FITS], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
