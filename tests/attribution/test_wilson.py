import pytest

from gpca.attribution.wilson import wilson_interval


def test_the_wilson_interval_is_that_of_the_literature():
    assert wilson_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    low, high = wilson_interval(10, 10)
    assert (low, high) == (pytest.approx(0.7225, abs=1e-4), 1.0)
    with pytest.raises(ValueError, match="no trials"):
        wilson_interval(0, 0)
