"""Table VII and its figure."""

import pandas as pd
import pytest

from gpca.comparison.published import printed_seconds, read_published
from gpca.errors import InputError
from gpca.model.runtime_file import COMPONENTS, OF_ONE_EXPLANATION, RUNTIME_COLUMNS
from gpca.reporting.figures.runtime import _bars, draw_runtime
from gpca.reporting.tables.runtime import table7_runtime


def rows(device="CPU", hardware="A processor, 2 cores", components=tuple(COMPONENTS), start=0.001):
    return pd.DataFrame(
        [(name, device, hardware, 1, 100, start * (i + 1), 0.0005, 0.002) for i, name in enumerate(components)],
        columns=RUNTIME_COLUMNS,
    )


RUNTIME = pd.concat([rows(), rows("GPU", "A GPU", ("features", "explanation"), 0.0001)], ignore_index=True)

NUMBERS = read_published()


def test_every_component_stands_beside_the_printed_value():
    table = table7_runtime(RUNTIME, "Tiny", NUMBERS)
    text = table.markdown()
    assert "| ICP alignment | CPU | CPU | 1.00 | 0.50 | 2.00 | 3000 |" in text
    assert "| Feature extraction | CPU | GPU | 3.00 | 0.50 | 2.00 | 1200 |" in text
    assert "| Feature extraction | GPU | GPU | 0.10 | 0.50 | 2.00 | 1200 |" in text
    assert "| GPC retraining (optional) | CPU | CPU | 7.00 | 0.50 | 2.00 | > 10000 |" in text
    assert "| One explanation, 512 points | CPU | – | 9.00 | 0.50 | 2.00 | – |" in text
    retraining = "GPC retraining (optional) takes 10 to 30 s."
    for said in (
        "Over 100 runs, 1 thread",
        "A processor, 2 cores",
        "A GPU",
        "i7-12700K",
        "RTX 3090",
        retraining,
    ):
        assert said in text
    assert set(printed_seconds(NUMBERS)) < set(COMPONENTS)
    assert "**" not in text.replace("**Runtime per component on Tiny, and as the paper prints it**", "")


def test_the_csv_holds_milliseconds_and_the_number_of_runs():
    records = {(row[0], row[1], row[3]): row for row in table7_runtime(RUNTIME, "Tiny", NUMBERS).records()[1:]}
    assert records["icp", "CPU", "mean"][4] == pytest.approx(1.0)
    assert records["icp", "CPU", "mean"][8] == 100
    assert records["retraining", "CPU", "published"][4:] == (10000.0, "", "", 1, 100, True)


def test_the_bars_add_up_to_one_explanation(tmp_path):
    paper, cpu, gpu = _bars(RUNTIME, NUMBERS).values()
    assert sum(paper.values()) == pytest.approx(4225)
    assert list(cpu) == list(gpu) == list(OF_ONE_EXPLANATION)
    assert sum(cpu.values()) == pytest.approx(1 + 3 + 4 + 5)
    assert gpu == cpu | {"features": pytest.approx(0.1)}
    for name in ("a", "b"):
        draw_runtime(RUNTIME, "Tiny", NUMBERS, tmp_path / f"{name}.pdf", tmp_path / f"{name}.png")
    for suffix in ("pdf", "png"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_what_was_not_measured_is_named():
    with pytest.raises(InputError, match="has no row of 'scores'"):
        _bars(RUNTIME[RUNTIME["component"] != "scores"], NUMBERS)
    with pytest.raises(InputError, match="has no rows"):
        table7_runtime(RUNTIME[:0], "Tiny", NUMBERS)
