import pytest

from gpca.reporting.words import in_words, plural


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 seeds"), (1, "1 seed"), ("1", "1 seed"), (2, "2 seeds"), ("1 to 3", "1 to 3 seeds")]
)
def test_only_one_has_no_s(count, words):
    assert plural(count, "seed") == words


def test_a_name_is_read_as_words():
    assert in_words("coffee_cup_2") == "coffee cup 2"
