import numpy as np
import pytest

from gpca.features.dataset import WIDTHS
from gpca.features.parts import COLUMNS, EVERYTHING, RESIDUALS, seen
from gpca.features.settings import GROUPS, MOTION, QUANTILES, REMEDIED

STARTS = np.cumsum([0, *(WIDTHS[group] for group in GROUPS)])
NUMBERED = {
    group: np.tile(np.arange(start, start + WIDTHS[group]), (2, 1)).astype(float)
    for group, start in zip(GROUPS, STARTS, strict=False)
}
ALL = ("pair", "motion", "runs", "remedies")


def names(sees, group):
    """Return the columns of a group that these parts show."""
    return (seen({group: NUMBERED[group]}, sees, {group: slice(None)})[0] - NUMBERED[group][0, 0]).astype(int).tolist()


def test_all_parts_show_every_descriptor_in_order():
    assert seen(NUMBERED, ALL)[0].tolist() == list(range(STARTS[-1]))
    assert seen(NUMBERED, ALL[::-1]).shape == (2, sum(WIDTHS[group] for group in EVERYTHING))


def test_without_motion_nothing_says_how_far_a_cloud_was_moved_or_would_be():
    assert [MOTION[i] for i in names(("pair",), "motion")] == ["fitness", "inlier_rmse"]
    assert [MOTION[i] for i in names(("pair", "motion"), "motion")] == list(MOTION[:5])
    arrays = {group: array.copy() for group, array in NUMBERED.items()}
    for part in ("motion", "runs", "remedies"):
        for group, columns in COLUMNS[part].items():
            arrays[group][:, columns] = np.nan
    assert not np.isnan(seen(arrays, ("pair",))).any()
    assert np.isnan(seen(arrays, ("pair", "motion"))).sum() == 2 * 3


def test_the_source_alone_shows_the_observed_cloud():
    assert names(("source",), "distances") == list(range(3 * QUANTILES, 4 * QUANTILES))
    assert names(("source",), "planes") == [3 * QUANTILES + i for i in (0, 2, 4)]
    assert seen(NUMBERED, ("source",)).shape == (2, QUANTILES + 3)


def test_quick_remedies_show_no_run_that_restarts_and_nothing_that_is_relative_to_one():
    shown = [REMEDIED[i] for i in names(("quick_remedies",), "remedied")]
    assert len(shown) == 3 * 4 + 2
    assert not any(name.startswith(("error", "phi")) for name in shown)
    assert {name.split("_")[1] for name in shown[:-2]} == {"2", "3", "6", "7"}  # subsets with the pose error left alone


def test_some_columns_of_some_groups_are_wanted():
    found = seen(NUMBERED, ("pair", "motion", "runs"), RESIDUALS)[0]
    assert found.tolist() == [*range(0, 3 * QUANTILES, 2), *NUMBERED["motion"][0]]
    with pytest.raises(ValueError, match="need at least one array"):
        seen(NUMBERED, ("motion",), {"entropy": slice(None)})
