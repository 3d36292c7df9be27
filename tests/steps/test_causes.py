"""The step ``causes`` by hand: the same bytes whatever the threads, and what it says of faulty files and settings."""

import numpy as np
import pytest

from ..hostile import refusal
from .by_words import run_apart
from .command_lines import arguments, arrays_changed, settings, truncated, untouched


def one_object(folder):
    with np.load(folder / "objects.npz") as archive:
        arrays = dict(archive)
    rows = slice(0, arrays["offsets"][1])
    chosen = {name: arrays[name][:1] for name in ("names", "diameters_m")}
    chosen |= {name: arrays[name][rows] for name in ("points_m", "normals")} | {"offsets": arrays["offsets"][:2]}
    np.savez(folder / "objects.npz", **chosen)


TIGHT = {"nominal": 1e-6, "failed": 0.06}
FAULTS = [
    (untouched, {"--objects": "nowhere.npz"}, "nowhere.npz: no such file; make it with"),
    (truncated("objects.npz"), {}, "objects.npz: is not a readable npz archive"),
    (arrays_changed("objects.npz", points_m=lambda points: points * np.nan), {}, "array 'points_m' contains NaN"),
    (one_object, {}, "causes of tiny: 1 object(s) cannot be split"),
    (untouched, settings("causes", icp={"method": "generalized"}), "the target has no normals; use point_to_point"),
    (untouched, {"--candidates": "causes.npz"}, "causes.npz"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, fault):
    spoil, changes, words = FAULTS[fault]
    spoil(folder)
    refusal(arguments("causes", changes), folder, words)


def test_states_that_cannot_be_filled_end_with_what_to_widen(folder):
    changes = settings("causes", severities={"rotation_deg": [0, 0], "translation": [0, 0.001]}, candidates=1)
    line = refusal(
        arguments("causes", changes),
        folder,
        "12 candidates yielded 0 of 5",
        "samples that failed from pose alone; raise causes.severities",
    )
    assert "raise causes.severities.rotation_deg or causes.severities.translation" in line


def test_objects_that_fail_when_clean_are_named_and_the_last_is_a_refusal(folder):
    done = run_apart(arguments("causes", settings("causes", limits=TIGHT)), folder)
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if "%|" not in line]
    assert [line.split("'")[1] for line in said[:-1]] == ["brick", "cone"]
    assert "nearly all clean pairs of every object have an error of at least 0.0001 % of the diameter" in said[-1]


def test_one_thread_or_two_give_the_same_bytes(folder, made):
    assert run_apart([*arguments("causes"), "--threads", "2"], folder).returncode == 0
    for name in ("causes.npz", "candidates.csv"):
        assert (folder / name).read_bytes() == (made / name).read_bytes()
