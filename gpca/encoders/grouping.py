"""Centers of a cloud and the points around them (PointNet++, Qi et al. 2017b, Sec. 3.2), on the CPU and with CUDA."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from gpca.encoders import grouping_kernels


@dataclass(frozen=True)
class Groups:
    """M groups of k points in each of B clouds.

    Attributes:
        centers_B_M_3: where the coordinates of a group's points have their origin.
        neighbors_B_M_k: the group's points by their numbers in the cloud.
        counts_B_M: how many of them are distinct; the other slots repeat the first one.
        radius: unit of the relative coordinates.
        is_whole: whether each cloud is one group of all its points in their order, around the origin.
    """

    centers_B_M_3: torch.Tensor
    neighbors_B_M_k: torch.Tensor
    counts_B_M: torch.Tensor
    radius: float = 1.0
    is_whole: bool = False

    @classmethod
    def whole(cls, points_B_N_3: torch.Tensor) -> Groups:
        """Return one group per cloud, all of its points, around the origin: absolute coordinates."""
        batch, n, _ = points_B_N_3.shape
        everything_N = torch.arange(n, dtype=torch.int32, device=points_B_N_3.device)
        counts_B_1 = torch.full((batch, 1), n, dtype=torch.int32, device=points_B_N_3.device)
        return cls(points_B_N_3.new_zeros(batch, 1, 3), everything_N.expand(batch, 1, n), counts_B_1, is_whole=True)


def farthest_points(points_B_N_3: torch.Tensor, n_centers: int) -> torch.Tensor:
    """Return the indices (B, M) of points far from one another, by farthest-point sampling from point 0 on.

    The clouds are random draws, so point 0 is a random one. Of a cloud with fewer than `n_centers` points each is
    taken once, so M is the smaller of the two numbers.
    """
    points_B_N_3 = points_B_N_3.detach()
    batch, n, _ = points_B_N_3.shape
    if n <= n_centers:
        return torch.arange(n, device=points_B_N_3.device).expand(batch, n)
    if points_B_N_3.device.type == "cpu":
        return torch.from_numpy(grouping_kernels.farthest_points(points_B_N_3.contiguous().numpy(), n_centers)).long()
    return _farthest_points_plain(points_B_N_3, n_centers)


def ball_query(
    points_B_N_3: torch.Tensor, centers_B_M_3: torch.Tensor, radius: float, k: int
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return neighbors (B, M, k) and counts (B, M), int32: the first k points within the radius of each center.

    Where there are fewer, the first one fills the remaining slots, and the count says how many are distinct. It is at
    least one, as centers are points of the cloud. k is at most N.
    """
    points_B_N_3, centers_B_M_3 = points_B_N_3.detach(), centers_B_M_3.detach()
    k = min(k, points_B_N_3.shape[1])
    if points_B_N_3.device.type == "cpu":
        points, centers = (x.contiguous().numpy() for x in (points_B_N_3, centers_B_M_3))
        neighbors, counts = grouping_kernels.ball_query(points, centers, radius, k)
        return torch.from_numpy(neighbors), torch.from_numpy(counts)
    return _ball_query_plain(points_B_N_3, centers_B_M_3, radius, k)


def take(x_B_N_F: torch.Tensor, index_B_M: torch.Tensor) -> torch.Tensor:
    """Return the rows (B, M, F) of each cloud that the indices name."""
    batch, n, _ = x_B_N_F.shape
    rows = index_B_M + n * torch.arange(batch, device=x_B_N_F.device).view(-1, *[1] * (index_B_M.ndim - 1))
    return x_B_N_F.reshape(batch * n, -1).index_select(0, rows.reshape(-1)).view(*index_B_M.shape, -1)


def _farthest_points_plain(points_B_N_3: torch.Tensor, n_centers: int) -> torch.Tensor:
    nearest_B_N = torch.full(points_B_N_3.shape[:2], torch.inf, dtype=points_B_N_3.dtype, device=points_B_N_3.device)
    chosen = [torch.zeros(len(points_B_N_3), dtype=torch.long, device=points_B_N_3.device)]
    for _ in range(n_centers - 1):
        last_B_1_3 = take(points_B_N_3, chosen[-1][:, None])
        nearest_B_N = torch.minimum(nearest_B_N, (points_B_N_3 - last_B_1_3).square().sum(-1))
        chosen.append(nearest_B_N.argmax(dim=1))
    return torch.stack(chosen, dim=1)


def _ball_query_plain(points_B_N_3, centers_B_M_3, radius, k):
    squares_B_M_N = (centers_B_M_3[:, :, None] - points_B_N_3[:, None]).square().sum(-1)
    within_B_M_N = squares_B_M_N <= radius * radius
    # Outside ones sort behind all inside ones; each kind keeps its order.
    n = points_B_N_3.shape[1]
    order_B_M_N = torch.arange(n, device=points_B_N_3.device) + n * ~within_B_M_N
    neighbors_B_M_k = order_B_M_N.topk(k, dim=-1, largest=False).values
    neighbors_B_M_k = torch.where(neighbors_B_M_k < n, neighbors_B_M_k, neighbors_B_M_k[..., :1]) % n
    counts_B_M = within_B_M_N.sum(-1).clamp(1, k)
    return neighbors_B_M_k.int(), counts_B_M.int()
