"""Table XIII and the figure of the same readings."""

import pandas as pd
import pytest

from gpca.comparison.readings import READING_COLUMNS
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, TIDY_COLUMNS
from gpca.experiments.specification_curve import draw_readings, table6_inputs, table13_readings

from ..config.configs import load

DEFAULTS = load()
RUN = Run(DEFAULTS | {"sources": {"ycb": {"title": "YCB", "stand_in": False}}})


def rows(verdict="not reproduced"):
    records = [
        ("IV", "RBF", column, "%", printed, printed, 95.0, verdict, "gpc_start", name, value, False, 2,
         (value - printed) / 3, abs(value - printed) <= 3, 0.125)
        for column, printed in (("YCB", 69.3), ("LINEMOD", 50.6))
        for name, value in (("kmeans/median", 95.0), ("random/default", 51.0))
    ]  # fmt: skip
    return pd.DataFrame(records, columns=list(READING_COLUMNS))


def test_a_row_says_where_the_number_lies_and_which_reading_is_nearest():
    text = table13_readings(RUN, rows()).markdown()
    [line] = [line for line in text.splitlines() if "LINEMOD" in line]
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[:6] == ["IV, RBF, LINEMOD", "%", "How the GPC starts", "produced", "random, default", "1 of 2"]
    assert cells[6] == "random, default (1 of 2)"
    assert cells[7:] == ["50.6", "95", "51", "95", "51", "12"]
    assert "between" in text


def test_numbers_on_stand_ins_are_shown_as_such_and_reproduced_ones_are_not():
    stand_in = Run(DEFAULTS | {"sources": {"ycb": {"title": "YCB", "stand_in": True}}})
    assert "procedural stand-in" in table13_readings(stand_in, rows("not comparable")).markdown()
    with pytest.raises(InputError, match="has nothing to show"):
        table13_readings(RUN, rows("reproduced"))


def test_each_number_is_a_dot_at_its_share_of_close_readings(same_bytes):
    many = pd.concat([rows().assign(row=f"kernel {i}") for i in range(8)], ignore_index=True)
    [panel] = draw_readings(RUN, many).axes
    assert [text.get_text() for text in panel.get_yticklabels()] == ["How the GPC starts"]
    at_none, at_half = sorted(dots.get_offsets().mean(axis=0).tolist() for dots in panel.collections)
    assert at_none[0] == pytest.approx(0) and at_half[0] == pytest.approx(50)
    assert [len(dots.get_offsets()) for dots in panel.collections] == [8, 8]
    assert [text.get_text() for text in panel.texts] == ["8 of 16"]
    same_bytes(lambda: draw_readings(RUN, rows()))
    with pytest.raises(InputError, match="has no readings"):
        draw_readings(RUN, rows("reproduced"))


def frame_rows(table, concept=ALL, **values):
    named = ("frame_input/" + table, "real_rgbd", "dgcnn-none")
    return [
        (*named, metric, concept, seed, v) for metric, of_seeds in values.items() for seed, v in enumerate(of_seeds)
    ]


def test_a_row_is_a_cloud_and_confusions_are_shares_of_the_concept():
    found = frame_rows("aligned/all", accuracy=(0.7, 0.8), test_samples=(300, 300))
    found += frame_rows("aligned/seen", accuracy=(0.9, 0.9), test_samples=(150, 150))
    found += frame_rows("observed/all", accuracy=(0.5, 0.6), test_samples=(300, 300))
    found += frame_rows(
        "observed/all", "pose", accuracy=(0.4, 0.6), test_samples=(100, 50), predicted_as_overlap=(30, 10)
    )
    table = table6_inputs(RUN, pd.DataFrame(found, columns=list(TIDY_COLUMNS)))
    assert [tuple(key for key, _ in row) for row in table.rows] == [
        ("dgcnn-none", "aligned"), ("dgcnn-none", "observed"),
    ]  # fmt: skip
    assert table.cells[0, "all"].mean == pytest.approx(75)
    assert table.cells[0, "seen"].mean == pytest.approx(90)
    assert table.cells[1, "pose_as_overlap"].mean == pytest.approx(25)
    assert (0, "pose_as_overlap") not in table.cells
    text = table.markdown()
    assert "| DGCNN | observed cloud before ICP |" in text
    assert "Mean over 2 seeds, the first of the run; with fewer than 3 there is no interval and no bold." in text
    assert "Test samples: all 600, seen 300." in text
    assert "±" not in text and table.best() == set()
    with pytest.raises(InputError, match="has nothing to show"):
        table6_inputs(RUN, pd.DataFrame(frame_rows("lost/all", accuracy=(1,)), columns=list(TIDY_COLUMNS)))
