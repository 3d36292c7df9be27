"""Seconds of every stage of an explanation (Table VII)."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, nan
from typing import Annotated, NamedTuple

from gpca.comparison.published import HARDWARE, Number, printed_seconds, read_published
from gpca.declarations.experiment import Experiment, Tidy
from gpca.declarations.plan import Run
from gpca.declarations.result import Figure, Frame, figure, table
from gpca.errors import InputError
from gpca.evaluation.runtime_file import COMPONENTS, OF_ONE_EXPLANATION, read_runtime
from gpca.experiments.frames import frames_of
from gpca.objects.entry import title_of
from gpca.reporting.figures.panels import legend_below, panels
from gpca.reporting.figures.style import BLUE, GRAY, GREEN, ORANGE, SMALL_PT, write_title
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell
from gpca.reporting.tables.table import EMPTY, Cell, Column, Table
from gpca.reporting.words import plural
from gpca.settings import Bounds

SECTION = "IV-E Real-world validation"
INPUTS = {"runtime": (read_runtime, "runtime.csv"), "published": (read_published, {})}
LOOKS = ((GRAY, "D"), (BLUE, "o"), (GREEN, "s"), (ORANGE, "^"))  # the paper's first, then those of our devices
ROW_IN = 0.34
ALL_STAGES = "All four"


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
    **INPUTS,
)
def table7_runtime(run: Run, runtime: Frame, published: Iterable[Number]) -> Table:
    if runtime.empty:
        raise InputError("runtime", "has no rows", "run the step 'runtime' first")
    printed = printed_seconds(published)
    heads = {"component": "Component", "device": "Device", "published_device": "Device (paper)"}
    sheet = TableBuilder("table7_runtime", heads)
    for row in runtime.itertuples():
        seconds = {"mean": row.mean_s, "deviation": row.deviation_s, "median": row.median_s}
        cells = {name: plain_cell(1e3 * value, 1, int(row.repeats)) for name, value in seconds.items()}
        number, device = printed.get(row.component), ""
        if number:
            device = number.device
            cells["published"] = Cell(1e3 * number.value, nan, 1, 100, at_least=number.upper > number.value)
        component = (row.component, COMPONENTS[row.component])
        sheet.add_row([component, (row.device, row.device), (device, device or EMPTY)], cells)
    here = "; ".join(f"{row.device}: {row.hardware}" for row in runtime.drop_duplicates("device").itertuples())
    there = "; ".join(f"{device}: {hardware}" for device, hardware in HARDWARE.items())
    ranges = "".join(
        f"; {COMPONENTS[component]} takes {number.text()} {number.unit}"
        for component, number in printed.items()
        if number.upper > number.value
    )
    repeats, threads = (int(runtime[name].iloc[0]) for name in ("repeats", "threads"))

    def milliseconds(name: str, decimals: int = 2) -> Column:
        return Column(f"{name} (ms)", decimals=decimals, interval=False, limits=(0, inf), least_is_best=True)

    return sheet.build(
        caption=f"Runtime per component on {model_title(run)}, and as the paper prints it",
        column_head="statistic",
        columns={
            "mean": milliseconds("Mean"),
            "deviation": milliseconds("Std. dev."),
            "median": milliseconds("Median"),
            "published": milliseconds("Paper", decimals=0),
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


class Stage(NamedTuple):
    """Mean time of a stage and its standard deviation over the runs, in ms; the paper prints no deviation."""

    mean: float
    deviation: float = 0.0


@figure(
    SECTION,
    "Runtime per component",
    """The mean time of each stage of one explanation and the sum of the four, in the paper and here, on one logarithmic
    scale. Bars are one standard deviation over the runs; the paper prints none. The hardware differs.""",
    name="runtime",
    **INPUTS,
)
def draw_runtime(run: Run, runtime: Frame, published: Iterable[Number]) -> Figure:
    series = stages_of(runtime, published)
    rows = [*(COMPONENTS[component] for component in OF_ONE_EXPLANATION), ALL_STAGES]
    drawing, [[panel]] = panels(1, 1, 0.9 + ROW_IN * len(rows))
    step = 0.7 / len(series)
    for place, (name, stages) in enumerate(series.items()):
        color, marker = LOOKS[min(place, len(LOOKS) - 1)]
        drawn = [*stages.values(), Stage(sum(stage.mean for stage in stages.values()))]
        for row, (mean, deviation) in enumerate(drawn):
            y = row + step * (place - (len(series) - 1) / 2)
            # A logarithmic axis has no place for what lies below zero.
            low, high = max(mean - deviation, 0.1 * mean), mean + deviation
            panel.plot([low, high], [y, y], color=color, linewidth=1.0)
            panel.plot(mean, y, marker, color=color, linestyle="", label=name if row == 0 else None)
            words = f"{mean:,.3g}" if mean < 1000 else f"{mean:,.0f}"
            look = {"textcoords": "offset points", "va": "center_baseline", "fontsize": SMALL_PT}
            panel.annotate(words, (high, y), (5, 0), **look)
    panel.margins(x=0.08)  # the last number needs room
    panel.axhline(len(rows) - 1.5, color=GRAY, linewidth=0.6)
    panel.set_yticks(range(len(rows)), rows)
    panel.set(ylim=(len(rows) - 0.5, -0.5), xscale="log", xlabel="milliseconds")
    panel.xaxis.set_major_formatter("{x:g}")
    panel.tick_params(axis="y", length=0)
    panel.grid(axis="x")
    panel.set_axisbelow(True)
    write_title(drawing, f"One explanation on {model_title(run)}")
    legend_below(drawing, *panel.get_legend_handles_labels())
    return drawing


def stages_of(runtime: Frame, published: Iterable[Number]) -> dict[str, dict[str, Stage]]:
    """Times of the stages by what measured them: the paper, and here without and with a GPU."""
    rows = list(runtime.itertuples())
    measured = {(row.component, row.device): Stage(1e3 * row.mean_s, 1e3 * row.deviation_s) for row in rows}
    printed = printed_seconds(published)
    paper = {component: Stage(1e3 * printed[component].value) for component in OF_ONE_EXPLANATION}
    series = {f"Paper, {' and '.join(HARDWARE.values())}": paper}
    for device, name in {row.device: row.hardware for row in rows}.items():
        stages = series.setdefault(f"Here, {name}", {})
        for component in OF_ONE_EXPLANATION:
            stage = measured.get((component, device), measured.get((component, "CPU")))
            if stage is None:
                raise InputError("runtime", f"has no row of '{component}'", "rerun the step 'runtime'")
            stages[component] = stage
    return series


def model_title(run: Run) -> str:
    return title_of(run.sources.get(run.config["model"]["source"]) or frames_of(run.config))
