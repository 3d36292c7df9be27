import pytest

from gpca.causes.settings import DescriptorSettings
from gpca.explainers.sight import WORDS, icp_calls, in_words

SETTINGS = DescriptorSettings(starts=3, restarts=8)


def test_words_stand_in_one_order_and_nothing_is_a_word():
    assert in_words(("motion", "pair")) == in_words(("pair", "motion")) == "pair + motion"
    assert in_words(()) == "nothing"
    assert all(in_words((part,)) == words for part, words in WORDS.items())


@pytest.mark.parametrize(
    ("sees", "calls"),
    [
        ((), 0),
        (("pair", "motion"), 0),
        (("pair", "runs"), 12),
        (("remedies",), 44),
        (("pair", "quick_remedies"), 12),
        (("pair", "motion", "runs", "remedies"), 56),
    ],
)
def test_calls_are_those_beyond_the_observed_run(sees, calls):
    assert icp_calls(sees, 13, SETTINGS) == calls
