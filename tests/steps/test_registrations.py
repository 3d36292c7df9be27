"""The step ``registrations`` by hand, and what it says of faulty files and settings."""

import numpy as np
import pytest

from .command_lines import arrays_changed, pickled, refused, settings, truncated, untouched

FAULTS = [
    (untouched, {"--objects": "nowhere.npz"}, r"nowhere.npz: no such file; make it with"),
    (pickled("objects.npz"), {}, r"objects.npz: contains pickled objects, which are never loaded"),
    (truncated("objects.npz"), {}, r"objects.npz: is not a readable npz archive"),
    (arrays_changed("objects.npz", normals=lambda n: n[1:]), {}, r"array 'normals' is 1199×3, not 1200×3"),
    (arrays_changed("objects.npz", points_m=lambda points: points * np.nan), {}, r"array 'points_m' contains NaN"),
    (
        untouched,
        settings("registrations", severities={"crop": [0.6, 0.2]}),
        r"severity crop: .* is in descending order",
    ),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "registrations", *FAULTS[fault])
