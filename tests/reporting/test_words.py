import pytest

from gpca.reporting.words import dataset_in_words, in_words, object_in_words, object_of_frames


@pytest.mark.parametrize(("name", "words"), [("lmo", "LINEMOD-Occlusion"), ("visp", "ViSP"), ("my_own", "my own")])
def test_a_dataset_is_called_by_its_title(name, words):
    assert dataset_in_words(name) == words


def test_a_name_is_read_as_words():
    assert in_words("coffee_cup_2") == "coffee cup 2"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("scenes 002_master_chef_can", "master chef can"),
        ("scenes big red_mug", "big red mug"),
        ("lmo obj_000006", "cat"),
        ("ycbv obj_000020", "extra large clamp"),
        ("ycbv obj_000022", "object 22 of ycbv"),
        ("mine obj_000006", "object 6 of mine"),
        ("brick", "brick"),
    ],
)
def test_an_object_of_frames_is_called_by_its_name_alone_or_by_number_and_dataset(name, words):
    assert object_of_frames(name) == words


@pytest.mark.parametrize(
    ("name", "dataset", "words"),
    [
        ("obj_000010", "ycbv", "banana"),
        ("obj_000010", "lm", "eggbox"),
        ("obj_000010", "", "object 10"),
        ("040_large_marker", "", "large marker"),
        ("ycb_025_mug", "", "mug"),
        ("065-h_cups", "", "cups (h)"),
        ("tapered_mug_3", "", "tapered mug 3"),
        ("25", "", "25"),
    ],
)
def test_an_object_has_the_name_that_a_reader_knows(name, dataset, words):
    assert object_in_words(name, dataset) == words
