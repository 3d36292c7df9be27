"""The step ``register_methods`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import STEP_OPTIONS, arrays_changed, refused, removed, settings, truncated, untouched

PAIRS = STEP_OPTIONS["register_methods"]["--settings"]["method_pairs"]


def pairs(**changed):
    return settings("register_methods", method_pairs=PAIRS | changed)


FAULTS = [
    (removed("registrations.npz"), {}, r"registrations.npz: no such file; make it with Snakemake"),
    (truncated("objects.npz"), {}, r"objects.npz: is not a readable npz archive"),
    (arrays_changed("registrations.npz", points=lambda p: p * float("nan")), {}, r"array 'points' contains NaN"),
    (
        arrays_changed("objects.npz", names=lambda names: names[::-1]),
        {},
        r"object 0 is not '\w+', as in the registr",
    ),
    (untouched, pairs(global_start="teaser"), r"global_start: 'teaser' is not among the methods"),
    (untouched, pairs(global_start="point_to_point"), r"'point_to_point': needs an initial pose"),
    (untouched, {"--rows": ["a.csv", "registrations.npz"]}, r"registrations.npz"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "register_methods", *FAULTS[fault])


def test_seconds_are_in_a_file_of_their_own(made):
    rows, seconds = ((made / name).read_text().splitlines() for name in ("point_trials.csv", "point_seconds.csv"))
    assert "seconds" not in rows[0]
    assert seconds[0] == "sample,start,seconds"
    assert len(rows) == len(seconds) == 1 + 2 * 3
    assert (made / "fgr_trials.csv").read_text().count(",none,") == 3


def test_a_missing_package_is_named(folder, capsys, monkeypatch):
    monkeypatch.setattr("gpca.alignment.methods.registry.find_spec", lambda name: None)
    changes = {"--methods": ["fgr", "gicp_small"]}
    refused(
        folder, capsys, "register_methods", untouched, changes, r"'gicp_small': needs the package small_gicp; install"
    )
