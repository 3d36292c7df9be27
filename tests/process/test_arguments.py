"""Numbers on the command line: each option of each step has its bounds, and what is out of them is one line."""

from argparse import Action, ArgumentParser
from importlib import import_module

import pytest

from gpca.__main__ import STEPS, module_of
from gpca.process.arguments import SURFACE_POINTS, whole_number
from tests.hostile import refusal


def options(step) -> list[Action]:
    parser = ArgumentParser()
    import_module(module_of(step)).add_arguments(parser)
    return parser._actions


NUMBERS = [
    (step, action.option_strings[0])
    for step in STEPS
    for action in options(step)
    if action.type not in (None, str) and "whole_number" in action.type.__qualname__
]
BAD = ("-3", "-1", "1e12", "1.5", "nan", "inf", "two", "", " ", "1_000", "٣", "0x10", "9" * 30, "9" * 5000, "--", "1 2")


def test_no_step_takes_a_number_without_bounds():
    kinds = {(step, action.dest): action.type for step in STEPS for action in options(step)}
    assert [name for name, kind in kinds.items() if kind in (int, float)] == []
    assert len(NUMBERS) > 15


@pytest.mark.parametrize(("step", "option"), NUMBERS)
def test_every_number_of_every_step_is_refused_where_it_cannot_be(tmp_path, step, option):
    refusal([step, option, "-5"], tmp_path, f"argument {option}", "whole number", "--help")


@pytest.mark.parametrize("text", [*BAD, "0", "100000", "257"])
def test_threads_that_cannot_be(tmp_path, text):
    refusal(["objects", "--threads", text], tmp_path, "argument --threads", "--help")


@pytest.mark.parametrize("text", [*BAD, "0", "255", "1048577"])
def test_points_that_cannot_be(tmp_path, text):
    refusal(["objects", "--surface-points", text], tmp_path, "argument --surface-points", "--help")


def test_both_ends_are_allowed():
    assert [SURFACE_POINTS("256"), SURFACE_POINTS("1048576"), whole_number(-2, 2)("-2")] == [256, 1048576, -2]


SETTINGS = {
    "no JSON": ("{", "invalid JSON"),
    "list": ("[]", "not a JSON object"),
    "number": ("3", "not a JSON object"),
    "empty": ("", "invalid JSON"),
    "key twice": ('{"kind": "bop", "kind": "mesh_folder"}', "key 'kind' appears twice"),
    "nested": ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deeply"),
    "endless digits": ('{"a": ' + "9" * 5000 + "}", "invalid JSON"),
    "control character": ('{"title": "a\\nb"}', "control character"),
    "half a letter": ('{"title": "\\ud800"}', "control character"),
    "unknown": ('{"knd": "bop"}', "did you mean kind?"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_that_cannot_be(tmp_path, name):
    text, word = SETTINGS[name]
    refusal(["objects", "--source", "mine", "--out", "objects.npz", "--settings", text], tmp_path, word)


@pytest.mark.parametrize("name", ["", " ", "tiny\nother", "tiny\u2028", "\x1b[2J"])
def test_names_that_are_empty_or_take_more_than_a_line_are_refused(tmp_path, name):
    words = ["registrations", "--objects", "a.npz", "--seed", 0, "--out", "b.npz", "--timings", "c.csv"]
    refusal([*words, "--source", name], tmp_path, "--source", "is empty or does not fit on one line; give a name")
