import pytest

from tests.judged import random_judged


@pytest.fixture
def judged():
    return random_judged()
