"""Pairs of clouds of one object, relative to its diameter, whose true pose is known."""

import numpy as np

from gpca.alignment.methods.interface import Pair
from gpca.alignment.pose_error import adds_error
from gpca.pairs.perturbation import PERTURBATIONS, Severities
from gpca.rigid import exp, inverse, transform


def clouds(objects, index, seed=0, points=250):
    """Disjoint points of one object and their normals: source, target, source's normals, target's."""
    order = np.random.default_rng(seed).permutation(len(objects.points(index)))
    all_points = objects.points(index).astype(float) / objects.diameters_m[index]
    all_normals = objects.normals_of(index)
    source, target = order[:points], order[points : 2 * points]
    return all_points[source], all_points[target], all_normals[source].astype(float), all_normals[target].astype(float)


POOR = {
    "plane": lambda points: points * [1, 1, 0],
    "line": lambda points: points * [0, 0, 1],
    "three": lambda points: points[:3],
    "five": lambda points: points[:5],
    "one point many times": lambda points: points[[0] * 20],
}


def small_motion(objects, index=0, seed=0):
    """A pair that any local method aligns, with normals of the model, and its true pose."""
    source, target, source_normals, target_normals = clouds(objects, index, seed)
    T_true = exp(np.array([[0.05, -0.04, 0.06, 0.03, -0.02, 0.04]]))[0]
    rotation = np.eye(4)
    rotation[:3, :3] = inverse(T_true)[:3, :3]
    moved, turned = transform(inverse(T_true), source), transform(rotation, source_normals)
    return Pair(moved, target, np.eye(4), turned, target_normals, seed), T_true


def perturbed(objects, index, concept, seed=0):
    """A pair of the protocol, with estimated normals, and its true pose."""
    source, target, _, _ = clouds(objects, index, seed)
    result = PERTURBATIONS[concept](source, Severities(), np.random.default_rng(seed))
    return Pair(result.points, target, seed=seed).with_normals(), result.T_target_source_true


def error(pair, outcome, T_true):
    """ADD-S of the source's points: the test objects are symmetric."""
    return adds_error(pair.source, outcome.T_target_source, T_true)
