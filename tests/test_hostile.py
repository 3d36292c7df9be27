"""The harness itself, so that no test of hostile input can pass by accident."""

import pytest

from .hostile import refusal

NOT_JSON = ["explain", "source.ply", "target.ply", "--settings", "not JSON"]


def test_a_refusal_is_one_line_with_status_2(tmp_path):
    line = refusal(NOT_JSON, tmp_path, "--settings", "invalid JSON")
    assert line.startswith("gpca explain:")


@pytest.mark.parametrize("arguments", [["explain"], ["explain", "--threads", "two"]])
def test_a_command_line_that_cannot_be_parsed_is_refused_in_one_line(tmp_path, arguments):
    refusal(arguments, tmp_path, "--help")


def test_a_command_that_succeeds_is_no_refusal(tmp_path):
    with pytest.raises(AssertionError, match="status 0"):
        refusal(["explain", "--help"], tmp_path)


def test_a_line_that_does_not_name_the_fault_is_found(tmp_path):
    with pytest.raises(AssertionError, match="does not say"):
        refusal(NOT_JSON, tmp_path, "a word that it does not say")
