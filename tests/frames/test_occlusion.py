from dataclasses import replace

import numpy as np
import pytest

from gpca.frames.occlusion import TOLERANCE, occlude


@pytest.mark.parametrize("share", [0.25, 0.4, 0.6])
def test_an_occluder_covers_the_share_in_one_piece(tiny, share):
    from scipy.ndimage import label

    instances, _ = tiny
    i = int(np.argsort(np.diff(instances.offsets))[len(instances) // 3])
    pixels = instances.pixels_of(i)
    kept = occlude(instances, i, pixels, share, np.random.default_rng(3))
    assert abs((1 - kept.mean()) - share) <= TOLERANCE
    covered = np.zeros((120, 160), bool)
    covered[tuple(pixels[~kept][:, ::-1].T)] = True
    regions, count = label(covered, np.ones((3, 3)))
    assert np.bincount(regions.ravel())[1:].max() > 0.9 * covered.sum()
    assert count < 5


def test_another_draw_is_another_occluder_and_the_same_draw_the_same(tiny):
    instances, _ = tiny
    pixels = instances.pixels_of(0)
    draws = [occlude(instances, 0, pixels, 0.4, np.random.default_rng(seed)) for seed in (1, 1, 2)]
    assert np.array_equal(draws[0], draws[1])
    assert not np.array_equal(draws[0], draws[2])


def test_without_another_object_nothing_can_stand_in_front(tiny):
    instances, _ = tiny
    alone = replace(instances, object_index=np.zeros(len(instances), int))
    assert occlude(alone, 0, instances.pixels_of(0), 0.4, np.random.default_rng(0)) is None
