from dataclasses import replace

import numpy as np
import pytest

from baselines.attached import attached
from gpca.errors import InputError


def test_the_array_comes_back_as_doubles(registrations):
    h = np.random.default_rng(0).normal(size=(len(registrations), 5)).astype(np.float32)
    array = attached(replace(registrations, attached={"embedding": h}), "embedding", None)
    assert array.dtype == np.float64
    assert np.array_equal(array, h)


@pytest.mark.parametrize(
    ("array", "fault"),
    [
        (lambda n: np.full((n, 4), np.nan), "contains NaN or infinity"),
        (lambda n: np.full((n, 4), np.inf), "contains NaN or infinity"),
        (lambda n: np.zeros((n, 0)), r"has shape \(54, 0\), not 54×any"),
        (lambda n: np.zeros(n), r"has shape \(54,\), not 54×any"),
        (lambda n: np.zeros((n - 1, 4)), r"has shape \(53, 4\), not 54×any"),
    ],
)
def test_a_damaged_array_is_refused(registrations, array, fault):
    with pytest.raises(InputError, match=rf"array 'embedding': {fault}"):
        attached(replace(registrations, attached={"embedding": array(len(registrations))}), "embedding", None)


def test_a_fixed_size_has_to_match(registrations):
    logits = {"head_logits": np.zeros((len(registrations), 2))}
    with pytest.raises(InputError, match=r"array 'head_logits': has shape \(54, 2\), not 54×3"):
        attached(replace(registrations, attached=logits), "head_logits", 3)


def test_an_array_that_nobody_attached_is_refused(registrations):
    with pytest.raises(InputError, match="array 'embedding': is not attached"):
        attached(registrations, "embedding", None)
