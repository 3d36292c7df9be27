"""The scale of what was observed."""

import numpy as np
import pytest

from gpca.reenactment.scale import Scale, find_scale
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import exp, inverse, transform


@pytest.fixture(scope="module")
def drill(four):
    index = four.row("035_power_drill")
    return np.random.default_rng(0).permutation(four.points(index).astype(float) / four.diameters_m[index])


@pytest.mark.parametrize(
    ("size", "noise", "hidden"), [(1.25, 0.005, 0.2), (0.8, 0.005, 0.2), (2.0, 0.0, 0.0), (1, 0.03, 0), (1, 0.002, 0.7)]
)
def test_a_wrong_scale_is_found_and_a_right_one_is_not_doubted(drill, size, noise, hidden):
    random = np.random.default_rng(100)
    points = drill[512:1536]
    points = points[points[:, 2] <= np.quantile(points[:, 2], 1 - hidden)][:400]
    T = exp(np.array([[0.2, 0.1, -0.3, 0.05, 0.0, 0.02]]))[0]
    observed = transform(inverse(T), size * points + noise * random.normal(size=points.shape))
    scale = find_scale(observed, [T], ModelSurface(drill[:512]), random)
    assert scale.factor == pytest.approx(size, rel=0.03)
    assert scale.off == (size != 1)


def test_a_scale_in_words():
    assert Scale(1.25, 9.0).words == "the source seems 1.25 times too large for the target"
    assert Scale(0.8, 9.0).words == "the source seems 1.25 times too small for the target"
    assert Scale(1.03, 9.0).words == ""
