"""The harness itself, so that no test of hostile input can pass by accident."""

import pytest

from .hostile import refusal

NOT_JSON = ["explain", "source.ply", "target.ply", "--settings", "not JSON"]


def test_a_refusal_is_one_line_with_status_2(tmp_path):
    line = refusal(NOT_JSON, tmp_path, "--settings", "invalid JSON")
    assert line.startswith("gpca explain:")
    for arguments in (["explain"], ["explain", "--threads", "two"]):  # argparse's own
        refusal(arguments, tmp_path, "--help")


def test_success_and_a_line_that_does_not_name_the_fault_are_no_refusals(tmp_path):
    with pytest.raises(AssertionError, match="status 0"):
        refusal(["explain", "--help"], tmp_path)
    with pytest.raises(AssertionError, match="does not say"):
        refusal(NOT_JSON, tmp_path, "a word that it does not say")
