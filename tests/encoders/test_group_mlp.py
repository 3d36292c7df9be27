import copy

import pytest
import torch

from gpca.encoders import group_kernels
from gpca.encoders.groups import GroupMLP, Groups, ball_query, farthest_points, take

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
    neighbours, counts = ball_query(points, centers, radius, k)
    assert counts.min() < k == counts.max()
    return Groups(centers, neighbours, counts, radius)


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
    for compiled in ("distinct_edges", "moments", "normalize", "normalize_backward", "normalize_max_backward"):
        assert len(getattr(group_kernels, compiled).signatures) == 1, compiled


def test_a_repeat_counts_in_the_statistics():
    made = layers(0, (6,))
    points = torch.tensor([[[0.0, 0, 0], [0.1, 0.2, 0], [0.9, 0.9, 0.9]]])
    made(points, None, Groups(points, *ball_query(points, points, 0.3, 3)))
    slots = {0: [0, 1, 0], 1: [0, 1, 0], 2: [2, 2, 2]}
    relative = torch.stack([points[0, j] - points[0, g] for g, slot in slots.items() for j in slot])
    y_9_F = made.linears[0](relative).detach()
    torch.testing.assert_close(made.norms[0].running_mean, 0.1 * y_9_F.mean(dim=0), **TOLERANCE)
    torch.testing.assert_close(made.norms[0].running_var, 0.9 + 0.1 * y_9_F.var(dim=0), **TOLERANCE)


def test_the_order_of_the_points_does_not_matter():
    made = layers()
    points, x = inputs()
    made(points, x, Groups.whole(points))
    made.eval()
    order = torch.randperm(points.shape[1])
    whole = made(points, x, Groups.whole(points))
    torch.testing.assert_close(made(points[:, order], x[:, order], Groups.whole(points)), whole, **TOLERANCE)


def test_a_copy_keeps_what_was_learned():
    made = layers()
    points, x = inputs()
    made(points, x, balls(points))
    other = copy.deepcopy(made).eval()
    assert torch.equal(other(points, x, balls(points)), made.eval()(points, x, balls(points)))
