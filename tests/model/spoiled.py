"""Model files that hold what cannot be: a saved one, of which a part is put in place of another or dropped."""

import functools

import torch
import trimesh

EXPLAIN = ["explain", "ball.ply", "ball.ply", "--unit", "mm", "--model", "model.pt"]
BALL = trimesh.creation.icosphere(3, radius=50)
NAN, HUGE = float("nan"), 10**9


def part(content, path):
    """The mapping that a path of names ends in, and its last name."""
    *parents, last = path.split("/")
    return functools.reduce(lambda inner, name: inner[name], parents, content), last


def put(path, value):
    def spoil(content):
        inner, last = part(content, path)
        inner[last] = value(inner[last]) if callable(value) else value

    return spoil


def drop(path):
    def spoil(content):
        inner, last = part(content, path)
        del inner[last]

    return spoil


def spoil(path, change):
    content = torch.load(path, weights_only=True)
    change(content)
    torch.save(content, path)


def indefinite(covariance):
    """Variances above 0, and between the first two values a correlation of 2."""
    covariance = covariance.clone()
    covariance[:, 0, 1] = covariance[:, 1, 0] = 2 * (covariance[:, 0, 0] * covariance[:, 1, 1]).sqrt()
    return covariance
