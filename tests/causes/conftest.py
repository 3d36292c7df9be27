"""The objects as the candidates need them."""

import pytest

from gpca.causes.measuring import read_subjects
from tests.pairs.conftest import pair  # noqa: F401


@pytest.fixture(scope="session")
def subjects(four):
    return read_subjects(four)
