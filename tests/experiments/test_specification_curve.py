"""Table XIII and the figure of the same readings."""

import pandas as pd
import pytest

from gpca.comparison.readings import READING_COLUMNS
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.experiments.specification_curve import draw_readings, table13_readings

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
