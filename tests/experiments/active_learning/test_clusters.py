"""Of how many families test samples are."""

import dataclasses

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.experiments.active_learning.clusters import of_causes, of_registrations


def test_the_families_of_test_samples_alone_are_counted(registrations, tmp_path):
    path = tmp_path / "registrations/tiny/seed0.npz"
    path.parent.mkdir(parents=True)
    in_test = registrations.split == "test"
    family_S = np.where(in_test, np.where(registrations.cluster == "brick", "box", "round"), "other")
    dataclasses.replace(registrations, cluster=family_S, axes=("tiny", 0)).save(path)
    assert of_registrations([path]) == {("tiny", 0): 2}


def test_a_file_of_another_seed_is_refused(registrations, tmp_path):
    path = tmp_path / "registrations/tiny/seed1.npz"
    path.parent.mkdir(parents=True)
    dataclasses.replace(registrations, axes=("tiny", 0)).save(path)
    with pytest.raises(InputError, match="seed"):
        of_registrations([path])


def test_registrations_with_measured_causes_are_counted_alike(causes, tmp_path):
    path = tmp_path / "causes/four/seed100.npz"
    path.parent.mkdir(parents=True)
    causes.save(path)
    own = causes.registrations
    assert of_causes([path]) == {("four", 100): len(set(own.cluster[own.rows("test")].tolist()))}
