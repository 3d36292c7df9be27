"""Registered pairs whose covariance can be known."""

import numpy as np

from gpca.alignment.methods.interface import Outcome, Pair
from gpca.rigid import exp
from gpca.uncertainty.estimators.interface import RegisteredPair

DEVIATION_6 = np.repeat([np.deg2rad(10), 0.05], 3) / np.sqrt(3)


def ellipsoid(seed, points=200):
    """Points of an ellipsoid with three different axes, and its normals."""
    directions = np.random.default_rng(seed).normal(size=(points, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    normals = directions / [0.5, 0.35, 0.2]
    return directions * [0.5, 0.35, 0.2], normals / np.linalg.norm(normals, axis=1, keepdims=True)


def plane(seed, points=200):
    """Points of a square, and its normals."""
    flat = np.column_stack([np.random.default_rng(seed).uniform(-0.5, 0.5, size=(points, 2)), np.zeros(points)])
    return flat, np.tile([0.0, 0.0, 1.0], (points, 1))


def registered(method="point_to_point", shape=ellipsoid, T_found=None, describe=None, noise=0.0):
    """Two draws of a shape, registered where they are, or said to be at another pose."""
    (source, source_normals), (target, target_normals) = shape(0), shape(1)
    source = source + noise * np.random.default_rng(2).normal(size=source.shape)
    pair = Pair(source, target, np.eye(4), source_normals, target_normals, seed=7)
    T_found = np.eye(4) if T_found is None else T_found
    return RegisteredPair(pair, Outcome(T_found, 1.0, 0.02), method, DEVIATION_6, describe)


FAR = exp(np.array([[0, 0, 0, 9.0, 0, 0]]))[0]
