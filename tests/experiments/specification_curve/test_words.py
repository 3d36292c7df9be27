"""Readings of the unstated in words."""

from itertools import product

import pytest
import yaml

from gpca.code_files import ROOT
from gpca.experiments.specification_curve.registry import GROUPS
from gpca.experiments.specification_curve.settings import name_of
from gpca.experiments.specification_curve.words import NUMBERS, WORDS, ReadingWords, reading_in_words

CHOICES = yaml.safe_load((ROOT / "config/readings.yaml").read_text())["readings"]["groups"]


@pytest.mark.parametrize(
    ("group", "reading", "words"),
    [
        ("kernel", "rbf/100", "RBF, 100 iterations"),
        ("pool", "0.01/4/120", "0.01 of the pool is new, batches of 4, 120 labels at the start"),
        (
            "gpc_start",
            "raw/kmeans/default/full",
            "raw inputs, inducing inputs by k-means, default lengthscale, all samples at once",
        ),
        ("kernel", "rbf", "rbf"),  # not of this form
        ("someones", "rbf/100", "rbf, 100"),
    ],
)
def test_a_reading_is_words(group, reading, words):
    assert reading_in_words(group, reading) == words


def test_sets_that_are_joined_are_both_named():
    shown = reading_in_words("diagnostics", "in_distribution+source/knn_embedding/max_score/aurc")
    assert shown.startswith("samples as in training and another dataset, distance to neighbors in the embedding, 1 -")


@pytest.mark.parametrize("group", CHOICES)
def test_every_reading_of_the_suite_has_words_of_its_own(group):
    names = list(GROUPS[group].choices)
    assert names == list(CHOICES[group])  # the order in which a reading names its values
    readings = [dict(zip(names, values, strict=True)) for values in product(*CHOICES[group].values())]
    shown = {reading_in_words(group, name_of(group, reading).partition("/")[2]) for reading in readings}
    assert len(shown) == len(readings)
    for reading in readings:
        for name, value in reading.items():
            assert name in NUMBERS or all(part in WORDS[name] for part in str(value).split("+"))


def test_reasons_say_groups_and_readings_in_words():
    words = ReadingWords()
    assert words.group("gpc_start") == "How the GPC starts"
    assert "/" not in words.reading("diagnostics", "in_distribution/knn_analytical/max_score/auroc_error")
    assert words.group("mine") == "mine"
