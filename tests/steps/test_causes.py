"""The step ``causes``: the same bytes whatever the threads, and what it says where states cannot be filled."""

from ..hostile import refusal
from .by_words import run_apart
from .command_lines import arguments, settings

TIGHT = {"nominal": 1e-6, "failed": 0.06}


def test_states_that_cannot_be_filled_end_with_what_to_widen(folder):
    changes = settings("causes", severities={"rotation_deg": [0, 0], "translation": [0, 0.001]}, candidates=1)
    words = "12 candidates yielded 0 of 5", "samples that failed from pose alone; change causes.severities"
    refusal(arguments("causes", changes), folder, *words)


def test_objects_that_fail_when_clean_are_named_and_the_last_is_a_refusal(folder):
    done = run_apart(arguments("causes", settings("causes", limits=TIGHT)), folder)
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if "%|" not in line]
    assert [line.split("'")[1] for line in said[:-1]] == ["brick", "cone"]
    assert "nearly all clean pairs of every object have an error of at least 0.0001 % of the diameter" in said[-1]
