from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.features.dataset import Descriptors, describe_all
from gpca.features.settings import GROUPS
from tests.features.conftest import FEW, ICP


@pytest.fixture(scope="module")
def described(causes):
    return describe_all(causes, "four", 100, FEW, ICP)


def test_every_row_is_described_in_finite_numbers_and_its_seconds_are_counted(causes, described):
    descriptors, seconds_S, icp_seconds_S = described
    assert set(descriptors.groups) == set(GROUPS)
    for group_S_F in descriptors.groups.values():
        assert len(group_S_F) == len(causes)
        assert np.isfinite(group_S_F).all()
    assert (seconds_S >= icp_seconds_S).all() and (icp_seconds_S > 0).all()


def test_a_description_does_not_depend_on_the_truth_or_on_other_rows(causes, described):
    some = causes.subset(np.array([3, 1]))
    hidden = replace(some, registrations=some.registrations.without_labels())
    again, _, _ = describe_all(hidden, "four", 100, FEW, ICP)
    for name in GROUPS:
        assert np.array_equal(again.groups[name], described[0].groups[name][[3, 1]])


def test_a_file_is_read_as_it_was_written_and_only_for_its_own_samples(causes, described, tmp_path):
    path = tmp_path / "descriptors.npz"
    described[0].save(path)
    read = Descriptors.load(path, causes.registrations)
    assert all(np.array_equal(read.groups[name], described[0].groups[name]) for name in GROUPS)
    with pytest.raises(InputError, match="its samples differ from those of the registrations"):
        Descriptors.load(path, causes.registrations.subset(np.arange(5)))
    arrays = dict(np.load(path))
    np.savez(path, **arrays | {"motion": arrays["motion"] * np.nan})
    with pytest.raises(InputError, match="array 'motion' contains NaN"):
        Descriptors.load(path, causes.registrations)
