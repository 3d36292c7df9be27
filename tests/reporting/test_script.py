import sys

import pytest

from gpca.errors import InputError
from gpca.reporting.script import logged


def test_a_users_mistake_is_one_line_in_the_log_and_status_2(tmp_path, capsys):
    log = tmp_path / "logs" / "table.log"
    with pytest.raises(SystemExit) as caught, logged([str(log)]):
        raise InputError("metrics.csv", "is empty", "make it anew")
    assert caught.value.code == 2
    assert log.read_text() == "metrics.csv: is empty; make it anew\n"
    assert capsys.readouterr().err == ""


def test_without_a_log_stderr_is_left_alone(capsys):
    with logged([]):
        print("note", file=sys.stderr)
    assert capsys.readouterr().err == "note\n"


def test_other_errors_pass_through(tmp_path):
    with pytest.raises(ZeroDivisionError), logged([str(tmp_path / "a.log")]):
        raise ZeroDivisionError
