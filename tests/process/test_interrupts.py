"""Ctrl-C ends a step wherever it falls: in plain code, where Python loses the exception, where a library changes it."""

import ctypes
import signal
import weakref

import pytest

from gpca.errors import InputError
from gpca.jobs.job import as_process
from gpca.process.progress import certain_interrupts, progress


@pytest.fixture(autouse=True)
def handled():
    """SIGINT as on a terminal; where the tests run in the background of a shell, it is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def lost(monkeypatch):
    """What the interpreter reports and then goes on."""
    reported = []
    monkeypatch.setattr("sys.unraisablehook", lambda report: reported.append(report.exc_type))
    return reported


def ctrl_c(*_):
    signal.raise_signal(signal.SIGINT)


class Deleted:
    def __del__(self):
        ctrl_c()


def in_a_destructor():
    Deleted()


def in_a_weakref_callback():
    watched = type("Watched", (), {})()
    reference = weakref.ref(watched, ctrl_c)
    del watched
    assert reference() is None


def in_a_callback_of_compiled_code():
    ctypes.CFUNCTYPE(None)(ctrl_c)()


LOSSES = [in_a_destructor, in_a_weakref_callback, in_a_callback_of_compiled_code]


@pytest.mark.parametrize("lose", LOSSES)
def test_an_interrupt_that_was_lost_stops_before_the_next_item(lose, lost, capsys):
    done = []
    with pytest.raises(KeyboardInterrupt), certain_interrupts():
        for item in progress(range(10), "items"):
            done.append(item)
            if item == 3:
                lose()
    assert done == [0, 1, 2, 3]
    assert lost == [KeyboardInterrupt]


@pytest.mark.parametrize("lose", LOSSES)
def test_an_interrupt_that_was_lost_is_raised_at_the_end_at_the_latest(lose, lost):
    with pytest.raises(KeyboardInterrupt), certain_interrupts():
        lose()
    assert lost == [KeyboardInterrupt]


def unchanged():
    ctrl_c()


def as_numba_does():
    """In whatever compiled code is interrupted, numba raises a SystemError, or several in a row."""
    try:
        ctrl_c()
    except KeyboardInterrupt as fault:
        raise SystemError from fault


def taken_for_a_damaged_file():
    try:
        as_numba_does()
    except Exception as fault:
        raise InputError("weights.pt", "not the weights") from fault


def taken_for_nothing():
    try:
        as_numba_does()
    except Exception:
        return 0


@pytest.mark.parametrize("stopped", [unchanged, as_numba_does, taken_for_a_damaged_file, taken_for_nothing])
def test_ctrl_c_is_known_in_whatever_it_is_changed_to(stopped, capsys):
    assert as_process("gpca train", stopped) == 130
    assert capsys.readouterr().err == "gpca train: stopped; repeat the command to continue\n"


def test_an_interrupt_is_forgotten_with_its_block():
    with pytest.raises(KeyboardInterrupt), certain_interrupts():
        ctrl_c()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with certain_interrupts():
        assert list(progress(range(3), "items")) == [0, 1, 2]


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda number, frame: None])
def test_who_ignores_or_handles_the_signal_keeps_doing_so(handler):
    signal.signal(signal.SIGINT, handler)
    with certain_interrupts():
        assert signal.getsignal(signal.SIGINT) is handler
        ctrl_c()
        assert list(progress(range(3), "items")) == [0, 1, 2]
    assert signal.getsignal(signal.SIGINT) is handler
