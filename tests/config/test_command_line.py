import pytest

from gpca.config.check import check
from gpca.config.command_line import with_types
from gpca.errors import InputError

from .configs import load, merged


def given(**values):
    """The default config below values of the command line, which Snakemake reads as text inside lists and mappings."""
    return with_types(merged(load(), values), values)


def test_values_of_the_command_line_have_the_types_of_a_config_file():
    config = given(
        seeds=["0", "3"],
        registrations={"train": "36", "severities": {"noise": ["0.01", "0.02"]}},
        sources={"linemod": "false"},
        data_dir="null",
        run="mine",
    )
    assert config["seeds"] == [0, 3]
    assert config["registrations"]["train"] == 36
    assert config["registrations"]["severities"]["noise"] == [0.01, 0.02]
    assert config["sources"]["linemod"] is False
    assert config["data_dir"] is None
    assert config["run"] == "mine"
    assert list(check(config)) == ["coffee_cup", "ycb"]


@pytest.mark.parametrize("text", ["a: b: c", "{", "/data: x", "2024-01-01", "[a, b]", "12:30", "010", "1_000", "on"])
def test_text_that_is_no_number_stays_text(text):
    assert given(downloads=text)["downloads"] == text


def test_what_the_command_line_did_not_give_stays_as_it_is():
    config = load() | {"seeds": ["0"], "registrations": {"train": "36"}}
    assert with_types(config, {}) == config
    assert with_types(config, {"seeds": [1], "registrations": {"train": 37}, "other": "1"}) == config


def test_a_number_in_place_of_a_list_is_one_line_that_says_how():
    with pytest.raises(InputError) as caught:
        check(given(seeds=0))
    assert str(caught.value) == "config key seeds: 0 should be a valid array; give a list: [0]"
