"""Numbers on the command line: each option of each command has its bounds, and what is out of them is one line."""

from argparse import Action, ArgumentParser

import pytest

from gpca.__main__ import COMMANDS, load_command
from gpca.process.arguments import whole_number
from tests.hostile import refusal


def options(command) -> list[Action]:
    parser = ArgumentParser()
    load_command(command)[0](parser)
    return parser._actions


NUMBERS = [
    (command, action.option_strings[0])
    for command in COMMANDS
    for action in options(command)
    if action.type not in (None, str) and "whole_number" in action.type.__qualname__
]
BAD = ("-3", "-1", "1e12", "1.5", "nan", "inf", "two", "", " ", "1_000", "٣", "0x10", "9" * 30, "9" * 5000, "--", "1 2")


def test_no_command_takes_a_number_without_bounds():
    kinds = {(command, action.dest): action.type for command in COMMANDS for action in options(command)}
    assert [name for name, kind in kinds.items() if kind in (int, float)] == []
    assert NUMBERS


@pytest.mark.parametrize(("command", "option"), NUMBERS)
def test_every_number_of_every_command_is_refused_where_it_cannot_be(tmp_path, command, option):
    refusal([command, option, "-5"], tmp_path, f"argument {option}", "whole number", "--help")


@pytest.mark.parametrize("text", [*BAD, "0", "100000", "257"])
def test_threads_that_cannot_be(tmp_path, text):
    refusal(["explain", "--threads", text], tmp_path, "argument --threads", "--help")


def test_both_ends_are_allowed():
    assert [whole_number(-2, 2)(text) for text in ("-2", "2")] == [-2, 2]


@pytest.mark.parametrize("text", [*(text for text in BAD if text not in ("1e12", "1.5", "9" * 30, "--")), "0"])
def test_lengths_that_cannot_be(tmp_path, text):
    refusal(["explain", "a.npy", "b.npy", "--scans", f"--voxel={text}"], tmp_path, "argument --voxel", "--help")


SETTINGS = {
    "no JSON": ("{", "invalid JSON"),
    "list": ("[]", "not a JSON object"),
    "number": ("3", "not a JSON object"),
    "empty": ("", "invalid JSON"),
    "key twice": ('{"kernel": "rbf", "kernel": "matern32"}', "key 'kernel' appears twice"),
    "nested": ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deeply"),
    "endless digits": ('{"a": ' + "9" * 5000 + "}", "invalid JSON"),
    "control character": ('{"title": "a\\nb"}', "control character"),
    "half a letter": ('{"title": "\\ud800"}', "control character"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_that_cannot_be(tmp_path, name):
    text, word = SETTINGS[name]
    refusal(["explain", "source.ply", "target.ply", "--settings", text], tmp_path, word)


@pytest.mark.parametrize("name", ["", " ", "tiny\nother", "tiny\u2028", "\x1b[2J"])
def test_names_that_are_empty_or_take_more_than_a_line_are_refused(tmp_path, name):
    fault = "is empty or does not fit on one line; give a name"
    refusal(["explain", "source.ply", "target.ply", "--method", name], tmp_path, "--method", fault)
