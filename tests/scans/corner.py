"""A corner of a room with a box and a ball in it, seen twice: neither scan has a point of the other."""

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.rigid import inverse, rigid_motion, rotate, transform
from gpca.scans.pair import ScanPair

SIDE_M = 2.4
T_TARGET_SOURCE = rigid_motion(Rotation.from_rotvec([0.2, -0.5, 0.9]).as_matrix(), [0.5, -1.0, 0.3])


def surface(random, points, ball=False):
    """Points (N, 3) of three walls, of a box on the floor and of a ball, or of a large ball alone."""
    if ball:
        large = random.normal(size=(points, 3))
        return SIDE_M / 2 * large / np.linalg.norm(large, axis=1, keepdims=True)
    walls = random.uniform(0, SIDE_M, size=(points, 3))
    walls[np.arange(points), random.integers(3, size=points)] = 0
    box = random.uniform(size=(points // 2, 3))
    box[np.arange(len(box)), random.integers(3, size=len(box))] = random.integers(2, size=len(box))
    small = random.normal(size=(points // 3, 3))
    small = small / np.linalg.norm(small, axis=1, keepdims=True)
    return np.concatenate([walls, box * [0.7, 0.5, 0.9] + [0.9, 0.3, 0], small * 0.35 + [0.5, 1.7, 0.8]])


def corner_pair(shared, noise_m=0.004, ball=False, points=3000, scene="corner"):
    """Two scans, each of a part of the corner along x; the source shares this part of its surface."""
    random = np.random.default_rng(100)
    source, target = (surface(random, points, ball) for _ in range(2))
    if shared < 1:  # the source has the upper end along x, the target the lower
        source = source[source[:, 0] > np.quantile(source[:, 0], 0.3)]
        target = target[target[:, 0] < np.quantile(source[:, 0], shared)]
    source, target = (cloud + noise_m * random.normal(size=cloud.shape) for cloud in (source, target))
    source = transform(inverse(T_TARGET_SOURCE), source)
    return ScanPair(source, target, T_TARGET_SOURCE, min(shared, 1.0), scene)


def start_off(pair, angle_deg, shift_m):
    """The true pose, turned about the middle of the source and shifted."""
    R = Rotation.from_rotvec(np.deg2rad(angle_deg) * np.array([0.48, 0.6, 0.64])).as_matrix()
    middle = rotate(pair.T_target_source, pair.source_N_3.mean(axis=0)) + pair.T_target_source[:3, 3]
    shift = shift_m * np.array([0.6, -0.64, 0.48])
    return rigid_motion(R, middle - rotate(R, middle) + shift) @ pair.T_target_source
