"""Seconds of every stage of an explanation (Table VII)."""

from dataclasses import dataclass
from math import inf, nan
from typing import Annotated, Any

from gpca.comparison.published import HARDWARE, printed_seconds, read_published
from gpca.declarations import Experiment, Frame, Run, Tidy, table
from gpca.errors import InputError
from gpca.evaluation.runtime_file import COMPONENTS, read_runtime
from gpca.experiments.frames import frames_of
from gpca.objects.entry import title_of
from gpca.reporting.sheet import EMPTY, Cell, Column, Table, TableBuilder, plain_cell, plural
from gpca.settings import Bounds

SECTION = "IV-E Real-world validation"


@dataclass(frozen=True)
class RuntimeSettings:
    """The number of times that every stage is timed."""

    repeats: Annotated[int, Bounds(minimum=2)] = 100


EXPERIMENT = Experiment(name="runtime", sections={"runtime": RuntimeSettings}, tidy=(Tidy("runtime.csv"),))


@table(
    SECTION,
    "Table VII: runtime per component",
    """Table VII of the paper: how long each component takes on this machine, and on the paper's. Compare ratios rather
    than times, since the hardware differs.""",
    paper=True,
    runtime=(read_runtime, "runtime.csv"),
)
def table7_runtime(run: Run, runtime: Frame) -> Table:
    if runtime.empty:
        raise InputError("runtime", "has no rows", "run the step 'runtime' first")
    printed = printed_seconds(read_published())
    heads = {"component": "Component", "device": "Device", "published_device": "Device (paper)"}
    sheet = TableBuilder("table7_runtime", heads)
    for row in runtime.itertuples():
        seconds = {"mean": row.mean_s, "deviation": row.deviation_s, "median": row.median_s}
        cells = {name: plain_cell(1e3 * value, 1, int(row.repeats)) for name, value in seconds.items()}
        if number := printed.get(row.component):
            cells["published"] = Cell(1e3 * number.value, nan, 1, 100, at_least=number.upper > number.value)
        device = (number.device, number.device) if number else ("", EMPTY)
        sheet.add_row([(row.component, COMPONENTS[row.component]), (row.device, row.device), device], cells)
    here = "; ".join(f"{row.device}: {row.hardware}" for row in runtime.drop_duplicates("device").itertuples())
    there = "; ".join(f"{device}: {hardware}" for device, hardware in HARDWARE.items())
    ranges = "".join(
        f"; {COMPONENTS[component]} takes {number.text()} {number.unit}"
        for component, number in printed.items()
        if number.upper > number.value
    )
    repeats, threads = (int(runtime[name].iloc[0]) for name in ("repeats", "threads"))
    titles = {"mean": "Mean", "deviation": "Std. dev.", "median": "Median", "published": "Paper"}
    look: dict[str, Any] = {"interval": False, "limits": (0, inf), "least_is_best": True}
    model = title_of(run.sources.get(run.config["model"]["source"]) or frames_of(run.config))
    return sheet.build(
        caption=f"Runtime per component on {model}, and as the paper prints it",
        column_head="statistic",
        columns={
            name: Column(f"{title} (ms)", decimals=0 if name == "published" else 2, **look)
            for name, title in titles.items()
        },
        footnotes=(
            f"Over {repeats} runs, {plural(threads, 'thread')}. Here {here}. Paper: {there}{ranges}.",
            "ICP from one initial pose, between clouds of up to as many points as in the protocol; feature extraction "
            "of all draws of one cloud; sampling and scores of one registration. BALD selection scores the whole pool "
            "and picks a batch; retraining learns that batch.",
            "One explanation is all that happens between two clouds and the scores, by the explainer of "
            "`python -m gpca explain`. 512 points: the encoder sees all of them, in one draw.",
        ),
    )
