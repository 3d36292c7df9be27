import os
import subprocess
import sys

import numpy as np
import pytest
import torch

from gpca.encoders import groups
from gpca.encoders.groups import Groups, ball_query, farthest_points, take


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


@pytest.mark.parametrize("sample", [farthest_points, groups._farthest_points_plain])
def test_farthest_points_are_those_of_a_plain_loop(sample):
    points = clouds()
    expected = [farthest_by_a_loop(cloud.double().numpy(), 20) for cloud in points]
    assert sample(points, 20).tolist() == expected


def test_of_a_small_cloud_every_point_is_a_center():
    assert farthest_points(clouds(2, 5), 8).tolist() == [[0, 1, 2, 3, 4]] * 2


def test_points_that_coincide_are_chosen_only_when_no_other_is_left():
    points = torch.tensor([[[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0, 0]]])
    assert farthest_points(points, 2).tolist() == [[0, 2]]
    assert farthest_points(points, 3).tolist() == [[0, 2, 0]]


@pytest.mark.parametrize("query", [ball_query, groups._ball_query_plain])
@pytest.mark.parametrize(("radius", "k"), [(0.05, 4), (0.3, 8), (0.3, 64), (2.0, 8)])
def test_a_ball_holds_the_first_points_within_its_radius(query, radius, k):
    points = clouds()
    centers = take(points, farthest_points(points, 10))
    neighbors, counts = query(points, centers, radius, k)
    for cloud, found, of_cloud, centers_M_3 in zip(points, neighbors, counts, centers, strict=True):
        for indices, count, center in zip(found, of_cloud, centers_M_3, strict=True):
            assert (indices.tolist(), int(count)) == in_ball_by_a_loop(cloud.numpy(), center.numpy(), radius, k)


def test_a_ball_holds_no_more_points_than_the_cloud():
    points = clouds(1, 6)
    neighbors, counts = ball_query(points, points, 2.0, 32)
    assert neighbors.tolist() == [[[0, 1, 2, 3, 4, 5]] * 6]
    assert counts.tolist() == [[6] * 6]


def test_rows_are_taken_from_their_own_cloud():
    points = clouds(2, 7)
    index = torch.tensor([[[3, 0], [1, 1]], [[6, 2], [0, 5]]])
    assert torch.equal(take(points, index)[1, 0, 1], points[1, 2])
    assert take(points, index).shape == (2, 2, 2, 3)


def test_a_whole_cloud_is_one_group_around_the_origin():
    groups = Groups.whole(clouds(4, 9))
    assert groups.is_whole
    assert groups.neighbors_B_M_k.tolist() == [[list(range(9))]] * 4
    assert groups.counts_B_M.tolist() == [[9]] * 4
    assert not groups.centers_B_M_3.any()
    points = clouds(4, 9)
    assert not Groups(points, *ball_query(points, points, 0.1, 4)).is_whole


def test_the_number_of_threads_changes_no_bit():
    program = """
import hashlib, torch
torch.set_num_threads(1)
from gpca.encoders.groups import GroupMLP
from gpca.encoders.groups import Groups, ball_query, farthest_points, take
torch.manual_seed(0)
points, layers = torch.rand(6, 90, 3), GroupMLP(3, (16, 32))
x = points.clone().requires_grad_()
centers = take(points, farthest_points(points, 30))
out = layers(points, x, Groups(centers, *ball_query(points, centers, 0.3, 12)))
out.square().sum().backward()
parts = [out.detach(), x.grad, *(p.grad for p in layers.parameters()), *(b.float() for b in layers.buffers())]
print(hashlib.sha256(b"".join(part.numpy().tobytes() for part in parts)).hexdigest())
"""
    digests = {
        subprocess.run(
            [sys.executable, "-c", program],
            env=os.environ | {"NUMBA_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in ("1", "2")
    }
    assert len(digests) == 1
