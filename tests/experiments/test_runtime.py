"""Table VII."""

import pandas as pd
import pytest

from gpca.comparison.published import printed_seconds, read_published
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.runtime_file import COMPONENTS, RUNTIME_COLUMNS
from gpca.experiments.runtime import table7_runtime


def rows(device="CPU", hardware="A processor, 2 cores", components=tuple(COMPONENTS), start=0.001):
    return pd.DataFrame(
        [(name, device, hardware, 1, 100, start * (i + 1), 0.0005, 0.002) for i, name in enumerate(components)],
        columns=RUNTIME_COLUMNS,
    )


RUNTIME = pd.concat([rows(), rows("GPU", "A GPU", ("features", "explanation"), 0.0001)], ignore_index=True)


RUN = Run({"sources": {"tiny": {"title": "Tiny", "stand_in": False}}, "model": {"source": "tiny"}})


def test_every_component_stands_beside_the_printed_value_and_a_run_without_any_is_named():
    table = table7_runtime(RUN, RUNTIME)
    text = table.markdown()
    assert "| ICP alignment | CPU | CPU | 1.00 | 0.50 | 2.00 | 3000 |" in text
    assert "| Feature extraction | CPU | GPU | 3.00 | 0.50 | 2.00 | 1200 |" in text
    assert "| Feature extraction | GPU | GPU | 0.10 | 0.50 | 2.00 | 1200 |" in text
    assert "| GPC retraining (optional) | CPU | CPU | 7.00 | 0.50 | 2.00 | > 10000 |" in text
    assert "| One explanation, 512 points | CPU | – | 9.00 | 0.50 | 2.00 | – |" in text
    for measured in ("100 runs, 1 thread", "A processor, 2 cores", "A GPU", "i7-12700K", "RTX 3090", "10 to 30 s"):
        assert measured in text
    assert set(printed_seconds(read_published())) < set(COMPONENTS)
    assert "**" not in text.replace("**Table VII: Runtime per component on Tiny, and as the paper prints it**", "")
    records = {(row[0], row[1], row[3]): row for row in table.records()[1:]}  # milliseconds and the number of runs
    assert records["icp", "CPU", "mean"][4] == pytest.approx(1.0)
    assert records["icp", "CPU", "mean"][8] == 100
    assert records["retraining", "CPU", "published"][4:] == (10000.0, "", "", 1, 100, True)
    with pytest.raises(InputError, match="has no rows"):
        table7_runtime(RUN, RUNTIME[:0])
