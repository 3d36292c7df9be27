from dataclasses import replace

import numpy as np
import pytest
import torch

from gpca.encoders import group_kernels
from gpca.encoders.groups import GroupMLP, Groups, farthest_points, take
from gpca.process.compilation import Loop


def clouds(batch=3, n=80, seed=0):
    return torch.rand(batch, n, 3, generator=torch.Generator().manual_seed(seed)) - 0.5


def farthest_by_a_loop(points_N_3, n_centers):
    chosen = [0]
    while len(chosen) < n_centers:
        distances = [min(np.sum((p - points_N_3[c]) ** 2) for c in chosen) for p in points_N_3]
        chosen.append(int(np.argmax(distances)))
    return chosen


def in_ball_by_a_loop(points_N_3, center_3, radius, k):
    found = [i for i, p in enumerate(points_N_3) if np.linalg.norm(p - center_3) <= radius][:k]
    return found + found[:1] * (k - len(found)), len(found)


def test_farthest_points_are_those_of_a_plain_loop_and_coincide_only_when_no_other_is_left():
    points = clouds()
    expected = [farthest_by_a_loop(cloud.double().numpy(), 20) for cloud in points]
    assert farthest_points(points, 20).tolist() == expected
    assert farthest_points(clouds(2, 5), 8).tolist() == [[0, 1, 2, 3, 4]] * 2
    points = torch.tensor([[[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 0]]])
    assert farthest_points(points, 2).tolist() == [[0, 2]]
    assert farthest_points(points, 3).tolist() == [[0, 2, 0]]


@pytest.mark.parametrize(("radius", "k"), [(0.05, 4), (0.3, 8), (0.3, 64), (2.0, 8)])
def test_a_ball_holds_the_first_points_within_its_radius(radius, k):
    points = clouds()
    centers = take(points, farthest_points(points, 10))
    made = Groups.balls(points, centers, radius, k)
    for cloud, found, of_cloud, centers_M_3 in zip(points, made.neighbors_B_M_k, made.counts_B_M, centers, strict=True):
        for indices, count, center in zip(found, of_cloud, centers_M_3, strict=True):
            assert (indices.tolist(), int(count)) == in_ball_by_a_loop(cloud.numpy(), center.numpy(), radius, k)


def test_a_ball_holds_no_more_points_than_the_cloud():
    points = clouds(1, 6)
    made = Groups.balls(points, points, 2.0, 32)
    assert made.neighbors_B_M_k.tolist() == [[[0, 1, 2, 3, 4, 5]] * 6]
    assert made.counts_B_M.tolist() == [[6] * 6]


def test_in_whatever_order_clouds_are_worked_on_no_bit_changes(monkeypatch):
    """Nor does the number of threads that share them out: each cloud is written to by one pass of a loop alone."""
    for name, loop in [*vars(group_kernels).items()]:
        if isinstance(loop, Loop):
            monkeypatch.setattr(group_kernels, name, loop.py_func)

    def numbers(order):
        monkeypatch.setattr(group_kernels, "prange", order)
        torch.manual_seed(0)
        points, layers = torch.rand(4, 20, 3), GroupMLP(3, (4, 6))
        x = points.clone().requires_grad_()
        centers = take(points, farthest_points(points, 6))
        out = layers(points, x, Groups.balls(points, centers, 0.5, 5))
        out.square().sum().backward()
        parts = [out.detach(), x.grad, *(p.grad for p in layers.parameters()), *(b.float() for b in layers.buffers())]
        return [part.numpy().tobytes() for part in parts]

    assert numbers(range) == numbers(lambda n: reversed(range(n)))


TOLERANCE = {"atol": 1e-4, "rtol": 1e-4}


def layers(in_features=5, widths=(16, 24, 32), last_relu=True):
    """With gammas of both signs, so that the maximum over normalized slots is not that over the slots."""
    torch.manual_seed(0)
    made = GroupMLP(in_features, widths, last_relu)
    for norm in made.norms:
        torch.nn.init.normal_(norm.weight)
        torch.nn.init.normal_(norm.bias)
    return made


def inputs(in_features=5, batch=4, n=60, offset=0.0):
    torch.manual_seed(1)
    return torch.rand(batch, n, 3) - 0.5 + offset, torch.randn(batch, n, in_features)


def balls(points, n_centers=20, radius=0.3, k=8):
    """Some of them full, most of them padded."""
    centers = take(points, farthest_points(points, n_centers))
    made = Groups.balls(points, centers, radius, k)
    assert made.counts_B_M.min() < k == made.counts_B_M.max()
    return made


def in_training(evaluate, made, points, x, groups):
    points, x = points.clone().requires_grad_(), x.clone().requires_grad_()
    out = evaluate(points, x, groups)
    torch.manual_seed(2)
    (out * torch.randn_like(out)).sum().backward()
    return {
        "out": out.detach(), "points": points.grad, "x": x.grad,
        **{name: parameter.grad for name, parameter in made.named_parameters()},
        **{name: buffer.float() for name, buffer in made.named_buffers()},
    }  # fmt: skip


@pytest.mark.parametrize("grouped", [balls, Groups.whole])
@pytest.mark.parametrize("last_relu", [True, False])
@pytest.mark.parametrize("offset", [0.0, 1.0])
def test_outputs_statistics_and_gradients_are_those_of_every_slot(grouped, last_relu, offset):
    fused, plain = layers(last_relu=last_relu), layers(last_relu=last_relu)
    points, x = inputs(offset=offset)
    groups = grouped(points)
    ours, theirs = (
        in_training(evaluate, made, points, x, groups) for evaluate, made in ((fused, fused), (plain.plain, plain))
    )
    assert ours.keys() == theirs.keys()
    for name, value in theirs.items():
        size = value.abs().max().clamp(min=1e-6)
        torch.testing.assert_close(ours[name] / size, value / size, **TOLERANCE, msg=lambda m, n=name: f"{n}: {m}")


@pytest.mark.parametrize("grouped", [balls, Groups.whole])
def test_inference_is_that_of_every_slot(grouped):
    made = layers(last_relu=False)
    points, x = inputs()
    groups = grouped(points)
    made(points, x, groups)
    torch.testing.assert_close(made.eval()(points, x, groups), made.plain(points, x, groups), **TOLERANCE)


def test_numba_compiles_every_pass_once():
    """For one layout of its arrays: compiling another one makes the first training seconds longer."""
    for grouped in (balls, Groups.whole):
        points, x = inputs()
        made = layers()
        in_training(made, made, points, x, grouped(points))
        made.eval()(points, x, grouped(points))
    for compiled in ("moments", "normalize", "normalize_backward", "normalize_max_backward"):
        assert len(getattr(group_kernels, compiled).dispatcher.signatures) == 1, compiled


def test_a_repeat_counts_in_the_statistics():
    made = layers(0, (6,))
    points = torch.tensor([[[0.0, 0, 0], [0.1, 0.2, 0], [0.9, 0.9, 0.9]]])
    made(points, None, replace(Groups.balls(points, points, 0.3, 3), radius=1.0))
    slots = {0: [0, 1, 0], 1: [0, 1, 0], 2: [2, 2, 2]}
    relative = torch.stack([points[0, j] - points[0, g] for g, slot in slots.items() for j in slot])
    y_9_F = made.linears[0](relative).detach()
    torch.testing.assert_close(made.norms[0].running_mean, 0.1 * y_9_F.mean(dim=0), **TOLERANCE)
    torch.testing.assert_close(made.norms[0].running_var, 0.9 + 0.1 * y_9_F.var(dim=0), **TOLERANCE)
