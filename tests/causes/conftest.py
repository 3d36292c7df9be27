"""The objects as the candidates need them."""

import pytest

from gpca.causes.subjects import read_subjects


@pytest.fixture(scope="session")
def subjects(four):
    return read_subjects(four)
