import numpy as np
import pytest

from gpca.reporting.figures.cloud_views import thinned, view_from


@pytest.mark.parametrize(("rows", "count"), [(1, 5), (5, 5), (3, 5), (7, 5), (1000, 6)])
def test_thinned_rows_are_different_ones_in_order_from_first_to_last(rows, count):
    kept = thinned(np.arange(rows), count)
    assert len(kept) == min(rows, count)
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == rows - 1


def test_a_view_is_a_rotation_that_looks_down_by_its_elevation():
    view = view_from(np.radians(-55), np.radians(32))
    np.testing.assert_allclose(view @ view.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(view) == pytest.approx(1)
    assert np.degrees(np.arcsin(view[2, 2])) == pytest.approx(32)
    assert np.degrees(np.arctan2(view[2, 1], view[2, 0])) == pytest.approx(-55)
    assert np.degrees(np.arcsin(view_from(0.3)[2, 2])) == pytest.approx(22)
