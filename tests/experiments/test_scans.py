"""Registration methods on scans: their config, and recalls from files of trials to Table XVII."""

import pandas as pd
import pytest

from gpca.config.layers import with_defaults
from gpca.errors import InputError
from gpca.evaluation.measures import tidy
from gpca.experiments import registration_methods
from gpca.experiments.registration_methods import read_seconds
from gpca.experiments.scans import check, collect, names, table17_published, table17_scans, titles_of_scans
from gpca.io.csv_file import write_csv
from gpca.reporting.tables.cells import rows_where
from tests.experiments.runs import run_with
from tests.scans.test_source import write_npz

VIRTUAL = {"title": "Rooms", "kind": "virtual", "rooms": 1}
ABSENT = {"title": "3DMatch", "kind": "threedmatch", "location": "not/there", "optional": True}
ABSENT["address"] = "https://example.org"


def run_of(rooms=VIRTUAL, data_dir=None):
    section = {
        "datasets": {"rooms": rooms, "threedmatch": ABSENT},
        "strata": [0.1, 0.3, 1.0],
        "success": {"room_m": 0.2, "object_share": 0.02},
        "ladder": [{"rotation_deg": 0, "translation_m": 0}, {"rotation_deg": 20, "translation_m": 0.5}],
        "global_start": "teaser",
    }
    return run_with(scans=section, methods=dict.fromkeys(("gicp", "teaser")), data_dir=data_dir)


@pytest.fixture
def config():
    return with_defaults({})


def test_data_sets_that_exist_are_registered(config, tmp_path):
    assert names(config, {})["scan_set"] == ["virtual_scans"]
    assert names(config, {})["scan_benchmark"] == []
    write_npz(tmp_path / "scans/3dmatch/floor.npz")
    there = config | {"data_dir": str(tmp_path)}
    assert names(there, {})["scan_set"] == ["virtual_scans", "threedmatch"]
    assert names(there, {})["scan_benchmark"] == ["threedmatch"]
    titles = titles_of_scans(there)
    assert titles["virtual_scans"] == "Virtual rooms and objects (procedural stand-in)"
    assert titles["threedmatch"] == "3DMatch and 3DLoMatch"
    check(there, lambda key: set())
    assert set(config["scans"]["methods"]) == set(config["methods"])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("methods", {"gicp": {"voxel": 1}}, r"scans.methods.gicp: registration method 'gicp': setting voxel: unknown"),
        ("global_start", "gicp", r"scans.global_start: registration method 'gicp': needs an initial pose"),
        ("global_start", "icp", r"scans.global_start: no registration method 'icp'"),
        ("datasets", {"ycb": {"title": "T", "kind": "virtual", "rooms": 1}}, "scans.datasets.ycb: is the name of a"),
        ("datasets", {"t": {"title": "T", "kind": "npz", "location": "no"}}, r"scans.datasets.t: .*no such file or fo"),
    ],
)
def test_faults_of_a_config(config, key, value, message):
    with pytest.raises(InputError, match=message):
        check(config | {"scans": config["scans"] | {key: value}}, lambda key: set())


def trials(starts=("initial", "teaser")):
    """Six pairs of three scenes, one of them an object; local ones are correct on the lower rung."""
    records = []
    for sample in range(6):
        for start in starts:
            low = sample % 2 == 0
            records.append(
                {
                    "sample": sample, "pair": f"s{sample // 2}/0/{sample}", "cluster": f"s{sample // 2}",
                    "kind": "object" if sample > 3 else "room", "size_m": 1.0 if sample > 3 else 3.0,
                    "overlap": 0.2 if sample < 3 else 0.8, "rung": "0deg_0m" if low else "20deg_0.5m",
                    "start": start, "rmse_m": 0.01 if low else 0.1, "rotation_error_rad": 0.1 if low else 0.5,
                    "translation_error_m": 0.1, "fitness": 0.5, "inlier_rmse": 0.01,
                    "failure": "" if low else "has not converged in 50 iterations",
                }
            )  # fmt: skip
    return pd.DataFrame(records)


@pytest.fixture
def files(tmp_path):
    paths = []
    for method, starts in (("gicp", ("initial", "teaser")), ("teaser", ("none",))):
        paths.append(tmp_path / f"scan_trials/rooms/{method}/seed0.csv")
        write_csv(paths[-1], trials(starts))
    return paths


@pytest.fixture
def intervals(files):
    return collect(run_of(), files)


def value(found, **wanted):
    [row] = rows_where(found, **wanted).to_dict("records")
    return row


def test_recalls_are_by_overlap_rung_and_list(intervals):
    assert set(intervals["method"]) == {"gicp", "teaser+gicp", "teaser"}
    row = value(intervals, method="gicp", metric="recall", concept="all")
    # 0.1 m is within the limit in rooms, and beyond 2 % of an object of a meter.
    assert (row["value"], row["samples"], row["clusters"]) == (pytest.approx(5 / 6), 6, 3)
    assert row["low"] < row["value"] < row["high"]
    expected = {
        "overlap_0.1_0.3": 1, "overlap_0.3_1": 2 / 3, "3DLoMatch": 1, "3DMatch": 2 / 3, "0deg_0m": 1,
        "20deg_0.5m": 2 / 3,
    }  # fmt: skip
    for concept, recall in expected.items():
        assert value(intervals, method="gicp", metric="recall", concept=concept)["value"] == pytest.approx(recall)
    assert value(intervals, method="gicp", metric="recall_15deg_30cm", concept="all")["value"] == pytest.approx(0.5)
    assert value(intervals, method="gicp", metric="failed", concept="all")["value"] == pytest.approx(0.5)


def test_faults_of_trials_are_one_line(files):
    write_csv(files[0], trials().drop(columns="rung"))
    with pytest.raises(InputError, match="column 'rung' is missing"):
        collect(run_of(), files)


def seconds(tmp_path):
    path = tmp_path / "timings/rooms/method_gicp/seed0.csv"
    write_csv(path, pd.DataFrame({"sample": [0, 0], "start": ["initial", "teaser"], "seconds": [0.5, 2.5]}))
    return read_seconds([path])


def test_tables_have_a_row_for_each_start_and_method(intervals, tmp_path, monkeypatch):
    table = table17_scans(run_of(), intervals, seconds(tmp_path))
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [
        ("rooms", "initial", "gicp"), ("rooms", "none", "teaser"), ("rooms", "teaser", "gicp")
    ]  # fmt: skip
    assert table.cells[0, "all"].mean == pytest.approx(500 / 6)
    assert table.cells[2, "seconds"].mean == pytest.approx(2.5)
    text = table.markdown()
    assert "Pairs of all seeds, by column: Rooms (procedural stand-in): 3, 3, of 3 scenes." in text
    assert "Not there, so left out: 3DMatch (https://example.org)." in text
    assert "below 0.2 m in rooms and 2 % of the size of objects" in text
    given = run_of().config["methods"]
    left_out = {"kiss_matcher": "kiss"}
    monkeypatch.setattr(registration_methods.registry, "left_out", lambda names: left_out if names == given else {})
    table = table17_scans(run_of(), intervals, seconds(tmp_path))
    assert [row for row, key in table.cells if key == "20deg_0.5m"] == [0]
    assert table.cells[0, "20deg_0.5m"].mean == pytest.approx(200 / 3)
    assert "KISS-Matcher needs the package kiss" in table.markdown()
    assert "From 20°, 0.5 m (%)" in table.markdown()


def test_published_recalls_stand_beside_those_of_the_run(intervals, tmp_path):
    write_npz(tmp_path / "rooms.npz")
    measured = {"title": "Rooms", "kind": "npz", "location": "rooms.npz", "benchmark": True}
    table = table17_published(run_of(measured, str(tmp_path)), intervals)
    run = [labels[1][0] for labels in table.rows if labels[0][0] == "run"]
    published = [labels[1][1] for labels in table.rows if labels[0][0] == "published"]
    assert run == ["teaser"] and "TEASER++" in published
    assert table.cells[0, "3DLoMatch"].mean == pytest.approx(200 / 3)
    assert "NeurIPS 2024" in table.markdown() and "FCGF" in table.markdown()
    assert 0 not in {row for row, _ in table.best()} or table.cells[0, "3DMatch"].seeds == 1
    with pytest.raises(InputError, match="has nothing to show"):
        table17_scans(run_of(), intervals[:0], tidy([("t", "s", "m", "seconds", "all", 0, 1.0)], "t"))
