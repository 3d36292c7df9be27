"""Adam without its class: the same bits as torch's, and none of its compiler."""

import subprocess
import sys

import pytest
import torch

from gpca.adam import Adam, OneCycle
from gpca.code_files import ROOT


def fitted(make, dtype):
    torch.manual_seed(0)
    weights = [torch.randn(5, 3, dtype=dtype, requires_grad=True), torch.randn(3, dtype=dtype, requires_grad=True)]
    optimiser = make(weights)
    for _ in range(25):
        optimiser.zero_grad()
        (weights[0] @ weights[1] - 1).square().sum().backward()
        optimiser.step()
    return weights


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_steps_are_those_of_torch_to_the_bit(dtype):
    ours = fitted(lambda weights: Adam(weights, 0.1), dtype)
    theirs = fitted(lambda weights: torch.optim.Adam(weights, lr=0.1, fused=True), dtype)
    assert all(torch.equal(*pair) for pair in zip(ours, theirs, strict=True))


def cycled(make, steps=9):
    """Return the weights after a cycle with decay, and the learning rates and β₁ on the way."""
    torch.manual_seed(0)
    weights = torch.randn(5, 3, requires_grad=True)
    optimiser, schedule, told = make([weights], steps)
    on_the_way = []
    for _ in range(steps):
        on_the_way.append(told(optimiser))
        optimiser.zero_grad()
        (weights.square().sum() - 1).square().backward()
        optimiser.step()
        schedule.step()
    return weights, [*on_the_way, told(optimiser)]


def torchs_cycle(weights, steps):
    optimiser = torch.optim.AdamW(weights, 0.02, weight_decay=0.1, fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 0.02, total_steps=steps, pct_start=0.25)
    return optimiser, schedule, lambda of: (of.param_groups[0]["lr"], of.param_groups[0]["betas"][0])


def own_cycle(weights, steps):
    optimiser = Adam(weights, 0.02, weight_decay=0.1)
    return optimiser, OneCycle(optimiser, 0.02, steps), lambda of: (of.learning_rate, of.beta1)


@pytest.mark.parametrize("steps", [5, 9, 120])
def test_a_cycle_is_torchs_to_the_bit(steps):
    ours, theirs = cycled(own_cycle, steps), cycled(torchs_cycle, steps)
    assert ours[1] == theirs[1]
    assert torch.equal(ours[0], theirs[0])


def test_what_was_kept_continues():
    def made():
        torch.manual_seed(0)
        weights = torch.randn(4, requires_grad=True)
        return (weights, *own_cycle([weights], 8)[:2])

    def steps(weights, optimiser, schedule, count):
        for _ in range(count):
            optimiser.zero_grad()
            weights.square().sum().backward()
            optimiser.step()
            schedule.step()

    whole, broken, continued = made(), made(), made()
    steps(*whole, 6)
    steps(*broken, 4)
    for own, kept in zip(continued[1:], broken[1:], strict=True):
        own.load_state_dict(kept.state_dict())
    continued[0].data = broken[0].data.clone()
    steps(*continued, 2)
    assert torch.equal(whole[0], continued[0])


FITS = {
    "a classifier": "from gpca.classifier.gpc import GPC, GPCSettings;"
    "settings = GPCSettings(iterations=2, inducing=2, draws=4);"
    "GPC(('a', 'b'), settings, 0).fit(np.arange(8.0).reshape(4, 2), np.array(['a', 'b'] * 2));",
    "a training": "from gpca.adam import Adam, OneCycle; import torch; x = torch.ones(2, requires_grad=True);"
    "adam = Adam([x], 0.1, 0.1); cycle = OneCycle(adam, 0.1, 5); x.sum().backward(); adam.step(); cycle.step();",
}


@pytest.mark.parametrize("fit", FITS)
def test_torchs_compiler_is_not_loaded_by(fit):
    code = f"import sys, numpy as np; {FITS[fit]} print('torch._dynamo' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"
