"""Every step by hand: all files with their provenance, the same bytes again, faults as the process's last word."""

import re

from gpca.__main__ import COMMANDS
from gpca.declarations.registry import steps as declared
from gpca.process.code_files import ROOT
from tests.steps.by_words import main, module_of, run_apart

from .command_lines import STEP_OPTIONS, arguments

# tests/frames/test_steps.py, tests/steps/test_frame_causes.py, test_recover.py,
# readings/test_step.py, test_joint.py and test_ship.py, tests/comparison/test_reference.py,
# tests/steps/test_guarantee.py and test_shifts.py, tests/page/test_two_runs.py
ELSEWHERE = {
    *("scenes", "instances", "frame_registrations", "frame_causes", "reenact_frames", "diagnose_frames"),
    *("guarantee", "recover", "readings", "ship"),
    *("retrain", "join_repeats", "measure_joint", "choose_joint", "apply_joint"),
    *("scan_causes", "diagnose_scans", "draw_shift", "observe_shift", "diagnose_shifts"),
    *("check-config", "check-reference", "bench", "score", "leaderboard", "compare", "ship-predictions"),
    *("repair", "calibrate"),
}
BY_HAND = {"labels.csv", "answers.txt"}  # given by a person, not made


def test_every_step_is_tested_here_or_elsewhere():
    rules = "".join(path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk"))
    modules = set(re.findall(r'step="(gpca[\w.:]+)"', rules)) | {step.run for step in declared()}
    steps = (set(STEP_OPTIONS) | ELSEWHERE) - set(COMMANDS)
    assert modules == {module_of(step) for step in steps}
    assert set(COMMANDS) <= set(STEP_OPTIONS) | ELSEWHERE


def test_every_step_runs_by_hand(made):
    values = [value for options in STEP_OPTIONS.values() for value in options.values()]
    words = [word for value in values for word in (value if isinstance(value, list) else [value])]
    outputs = {word for word in words if isinstance(word, str) and "." in word[1:]} - BY_HAND
    for name in outputs:
        assert (made / name).stat().st_size > 0
        assert (made / f"{name}.provenance.json").is_file()
    assert not [path for path in made.rglob("*") if "checkpoint" in path.name or "partial" in path.name]


def test_a_step_made_anew_gives_the_same_bytes(folder, made):
    for step in STEP_OPTIONS:
        if step not in ("label", "runtime", "explain"):  # of a person, of seconds, and on stdout
            assert main(arguments(step)) == 0
    for path in (path for path in made.iterdir() if path.suffix in (".npz", ".pt", ".csv")):
        if b"seconds" not in path.read_bytes().splitlines()[0]:
            assert (folder / path.name).read_bytes() == path.read_bytes(), path.name


def test_the_process_ends_with_status_2_and_that_line_alone(folder):
    done = run_apart(arguments("attribute", {"--explainer": "shapley"}), folder)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith("gpca attribute: explainer 'shapley': unknown; choose one of")
