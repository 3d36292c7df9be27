"""Recalls on scans from files of trials to tables."""

import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import tidy
from gpca.experiments.registration_methods import read_seconds
from gpca.experiments.scans.metrics import collect_scans, read_trials
from gpca.experiments.scans.published import table17_published
from gpca.experiments.scans.tables import table17_ladder, table17_scans
from gpca.io.csv_file import write_csv

STRATA = [0.1, 0.3, 1.0]
SUCCESS = {"room_m": 0.2, "object_share": 0.02}
LADDER = [{"rotation_deg": 0, "translation_m": 0}, {"rotation_deg": 20, "translation_m": 0.5}]
METHODS = {"gicp": {"title": "GICP", "is_global": False}, "teaser": {"title": "TEASER", "is_global": True}}
TITLES = {"rooms": "Rooms"}


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
def found(files):
    return collect_scans(files, STRATA, SUCCESS)


def value(found, **wanted):
    for column, content in wanted.items():
        found = found[found[column] == content]
    [row] = found.to_dict("records")
    return row


def test_recalls_are_by_overlap_rung_and_list(found):
    assert set(found["method"]) == {"gicp", "teaser+gicp", "teaser"}
    row = value(found, method="gicp", metric="recall", concept="all")
    # 0.1 m is within the limit in rooms, and beyond 2 % of an object of a meter.
    assert (row["value"], row["samples"], row["clusters"]) == (pytest.approx(5 / 6), 6, 3)
    assert row["low"] < row["value"] < row["high"]
    expected = {
        "overlap_0.1_0.3": 1, "overlap_0.3_1": 2 / 3, "3DLoMatch": 1, "3DMatch": 2 / 3, "0deg_0m": 1,
        "20deg_0.5m": 2 / 3,
    }  # fmt: skip
    for concept, recall in expected.items():
        assert value(found, method="gicp", metric="recall", concept=concept)["value"] == pytest.approx(recall)
    assert value(found, method="gicp", metric="recall_15deg_30cm", concept="all")["value"] == pytest.approx(0.5)
    assert value(found, method="gicp", metric="failed", concept="all")["value"] == pytest.approx(0.5)


def test_without_a_correspondence_there_is_no_success(files):
    write_csv(files[1], trials(("none",)).assign(fitness=0.0))
    found = collect_scans(files[1:], STRATA, SUCCESS)
    assert set(found[found["metric"] != "failed"]["value"]) == {0}


def test_faults_of_trials_are_one_line(files):
    with pytest.raises(InputError, match="scans: no files were given"):
        collect_scans([], STRATA, SUCCESS)
    write_csv(files[0], trials().drop(columns="rung"))
    with pytest.raises(InputError, match="column 'rung' is missing"):
        read_trials(files[0])


def seconds(tmp_path):
    path = tmp_path / "timings/rooms/method_gicp/seed0.csv"
    write_csv(path, pd.DataFrame({"sample": [0, 0], "start": ["initial", "teaser"], "seconds": [0.5, 2.5]}))
    return read_seconds([path])


def test_tables_have_a_row_for_each_start_and_method(found, tmp_path):
    missing = {"3DMatch": "https://example.org"}
    table = table17_scans(found, seconds(tmp_path), TITLES, METHODS, "teaser", STRATA, SUCCESS, {}, missing)
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [
        ("rooms", "initial", "gicp"), ("rooms", "none", "teaser"), ("rooms", "teaser", "gicp")
    ]  # fmt: skip
    assert table.cells[0, "all"].mean == pytest.approx(500 / 6)
    assert table.cells[2, "seconds"].mean == pytest.approx(2.5)
    text = table.markdown()
    assert "Pairs of all seeds, by column: Rooms: 3, 3, of 3 scenes." in text
    assert "Not there, so left out: 3DMatch (https://example.org)." in text
    assert "below 0.2 m in rooms and 2 % of the size of objects" in text
    by_start = table17_ladder(found, TITLES, METHODS, "teaser", LADDER, SUCCESS, {"KISS": "kiss"}, {})
    assert [labels[1][0] for labels in by_start.rows] == ["gicp"]
    assert by_start.cells[0, "20deg_0.5m"].mean == pytest.approx(200 / 3)
    assert "KISS needs the package kiss" in by_start.markdown()
    assert "20°, 0.5 m (%)" in by_start.markdown()


def test_published_recalls_stand_beside_those_of_the_run(found):
    table = table17_published(found, TITLES, ["rooms"], METHODS)
    run = [labels[1][0] for labels in table.rows if labels[0][0] == "run"]
    published = [labels[1][1] for labels in table.rows if labels[0][0] == "published"]
    assert run == ["teaser"] and "TEASER++" in published
    assert table.cells[0, "3DLoMatch"].mean == pytest.approx(200 / 3)
    assert "NeurIPS 2024" in table.markdown() and "FCGF" in table.markdown()
    assert 0 not in {row for row, _ in table.best()} or table.cells[0, "3DMatch"].seeds == 1


def test_nothing_to_show_is_a_fault(found):
    with pytest.raises(InputError, match="has nothing to show"):
        table17_scans(found[:0], tidy([("t", "s", "m", "seconds", "all", 0, 1.0)], "t"), TITLES, METHODS, "teaser",
                      STRATA, SUCCESS, {}, {})  # fmt: skip
