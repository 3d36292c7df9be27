"""Table VII and its figure."""

import pandas as pd
import pytest

from gpca.comparison.published import printed_seconds, read_published
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.runtime_file import COMPONENTS, OF_ONE_EXPLANATION, RUNTIME_COLUMNS
from gpca.experiments.runtime import ALL_STAGES, draw_runtime, stages_of, table7_runtime


def rows(device="CPU", hardware="A processor, 2 cores", components=tuple(COMPONENTS), start=0.001):
    return pd.DataFrame(
        [(name, device, hardware, 1, 100, start * (i + 1), 0.0005, 0.002) for i, name in enumerate(components)],
        columns=RUNTIME_COLUMNS,
    )


RUNTIME = pd.concat([rows(), rows("GPU", "A GPU", ("features", "explanation"), 0.0001)], ignore_index=True)

NUMBERS = read_published()
RUN = Run({"sources": {"tiny": {"title": "Tiny", "stand_in": False}}, "model": {"source": "tiny"}})


def test_every_component_stands_beside_the_printed_value():
    table = table7_runtime(RUN, RUNTIME, NUMBERS)
    text = table.markdown()
    assert "| ICP alignment | CPU | CPU | 1.00 | 0.50 | 2.00 | 3000 |" in text
    assert "| Feature extraction | CPU | GPU | 3.00 | 0.50 | 2.00 | 1200 |" in text
    assert "| Feature extraction | GPU | GPU | 0.10 | 0.50 | 2.00 | 1200 |" in text
    assert "| GPC retraining (optional) | CPU | CPU | 7.00 | 0.50 | 2.00 | > 10000 |" in text
    assert "| One explanation, 512 points | CPU | – | 9.00 | 0.50 | 2.00 | – |" in text
    for measured in ("100 runs, 1 thread", "A processor, 2 cores", "A GPU", "i7-12700K", "RTX 3090", "10 to 30 s"):
        assert measured in text
    assert set(printed_seconds(NUMBERS)) < set(COMPONENTS)
    assert "**" not in text.replace("**Runtime per component on Tiny, and as the paper prints it**", "")
    records = {(row[0], row[1], row[3]): row for row in table.records()[1:]}  # milliseconds and the number of runs
    assert records["icp", "CPU", "mean"][4] == pytest.approx(1.0)
    assert records["icp", "CPU", "mean"][8] == 100
    assert records["retraining", "CPU", "published"][4:] == (10000.0, "", "", 1, 100, True)


def test_the_stages_add_up_to_one_explanation():
    paper, cpu, gpu = stages_of(RUNTIME, NUMBERS).values()
    assert sum(stage.mean for stage in paper.values()) == pytest.approx(4225)
    assert {stage.deviation for stage in paper.values()} == {0}
    assert list(cpu) == list(gpu) == list(OF_ONE_EXPLANATION)
    assert sum(stage.mean for stage in cpu.values()) == pytest.approx(1 + 3 + 4 + 5)
    assert gpu == cpu | {"features": pytest.approx((0.1, 0.5))}


def test_all_times_are_on_one_scale_and_ours_have_their_spread(same_bytes):
    [panel] = draw_runtime(RUN, RUNTIME, NUMBERS).axes
    assert panel.get_xscale() == "log"
    assert [label.get_text() for label in panel.get_yticklabels()][-1] == ALL_STAGES
    spans = [line.get_xdata() for line in panel.get_lines() if len(line.get_xdata()) == 2 and line.get_linewidth() == 1]
    icp = next(span for span in spans if span[0] != span[1])
    assert list(icp) == pytest.approx([0.5, 1.5])
    same_bytes(lambda: draw_runtime(RUN, RUNTIME, NUMBERS))


def test_what_was_not_measured_is_named():
    with pytest.raises(InputError, match="has no row of 'scores'"):
        stages_of(RUNTIME[RUNTIME["component"] != "scores"], NUMBERS)
    with pytest.raises(InputError, match="has no rows"):
        table7_runtime(RUN, RUNTIME[:0], NUMBERS)
