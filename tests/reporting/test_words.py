import pytest

from gpca.reporting.words import in_words, object_of_frames, plural


@pytest.mark.parametrize(
    ("count", "words"), [(0, "0 seeds"), (1, "1 seed"), ("1", "1 seed"), (2, "2 seeds"), ("1 to 3", "1 to 3 seeds")]
)
def test_only_one_has_no_s(count, words):
    assert plural(count, "seed") == words


def test_a_name_is_read_as_words():
    assert in_words("coffee_cup_2") == "coffee cup 2"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("scenes 002_master_chef_can", "master chef can"),
        ("scenes big red_mug", "big red mug"),
        ("lmo obj_000006", "object 6 of lmo"),
        ("ycbv obj_000020", "object 20 of ycbv"),
        ("brick", "brick"),
    ],
)
def test_an_object_of_frames_is_called_by_its_name_alone_and_a_number_by_its_dataset_too(name, words):
    assert object_of_frames(name) == words
