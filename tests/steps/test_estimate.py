"""The step ``estimate`` by hand, and what it says of faulty files and settings."""

import pytest

from .command_lines import STEP_OPTIONS, arrays_changed, refused, removed, settings, truncated, untouched

PAIRS = STEP_OPTIONS["estimate"]["--settings"]["estimator_pairs"]


def pairs(**changed):
    return settings("estimate", estimator_pairs=PAIRS | changed)


FAULTS = [
    (removed("causes.npz"), {}, r"causes.npz: no such file; make it with 'python -m gpca causes'"),
    (truncated("objects.npz"), {}, r"objects.npz: is not a readable npz archive"),
    (arrays_changed("objects.npz", names=lambda names: names[::-1]), {}, r"objects of tiny: object \d is not '\w+'"),
    (untouched, settings("estimate", censi={}), r"setting censi: unknown; choose one of estimator_pairs, estimators"),
    (untouched, settings("estimate", estimators={"gauss": {}}), r"estimator 'gauss': unknown; choose one of"),
    (untouched, settings("estimate", estimators={"censi": {"sigma": 1}}), r"setting sigma: unknown"),
    (untouched, settings("estimate", estimators={"censi": 3}), r"setting censi: 3 should be a valid dictionary"),
    (untouched, pairs(starts=5), r"setting starts: 5 should be greater than or equal to 20"),
    (untouched, pairs(start=50), r"setting start: unknown; did you mean starts\?"),
    (untouched, pairs(methods={"fgr": 3}), r"registration method 'fgr': is global, so its results have no spread"),
    (untouched, pairs(methods={"icp": 3}), r"registration method 'icp': unknown"),
    (
        untouched,
        pairs(methods={"point_to_point": 0}),
        r"setting methods.point_to_point: 0 should be greater than or equal to",
    ),
    (untouched, {"--estimators": ["gauss"]}, r"estimator 'gauss': unknown"),
    (
        untouched,
        {"--out": ["a.csv"]},
        r"--out: 1 file\(s\) for 3 pair\(s\) of reference or estimator and seed",
    ),
    (untouched, {"--seeds": [0, 1]}, r"--out: 3 file\(s\) for 6 pair"),
    (untouched, {"--samples": ["causes.npz"]}, r"causes.npz"),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "estimate", *FAULTS[fault])


def test_seconds_are_in_a_file_of_their_own(made):
    rows, seconds = ((made / name).read_text().splitlines() for name in ("brossard_said.csv", "brossard_seconds.csv"))
    assert "seconds" not in rows[0]
    assert seconds[0] == "sample,method,seconds"
    assert len(rows) == len(seconds) == 1 + 2
