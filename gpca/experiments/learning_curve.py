"""Diagnosis of causes by the number of training samples: an estimate of what an observer can reach."""

from collections.abc import Mapping
from typing import Any

from gpca.causes.judged import CEILING
from gpca.declarations import Experiment, Frame, LeftOut, Paths, Run, Step, figure, numbers
from gpca.errors import InputError
from gpca.evaluation.measures import read_samples, tidy
from gpca.experiments.diagnosis import FURTHER
from gpca.io.csv_file import read_numbers
from gpca.reporting.figures.panels import in_lines, legend_below, panels
from gpca.reporting.figures.style import BLUE, COLUMN_WIDTH_IN, GRAY, ORANGE
from gpca.settings import read_settings
from gpca.steps.learning_curve import CURVE_COLUMNS, MEASURED, CurveSettings, labeled_samples

NAME = "learning_curve"
FILES = "learning_curve/{source}/seed{curve_seed}.csv"


def check(config: dict, _left_out: LeftOut) -> None:
    pool = len(config["sources"]) * (labeled_samples(config["causes"]) + config[NAME]["further"])
    if (least := min(config[NAME]["sizes"])) > pool:
        fault = f"{least} is more than the {pool} labeled samples that there are"
        raise InputError("config key learning_curve.sizes", fault, "lower it, or raise learning_curve.further")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    settings = read_settings(CurveSettings, config[NAME])
    return {"curve_seed": list(config["seeds"])[: settings.seeds], "chunk": list(range(len(settings.chunks())))}


EXPERIMENT = Experiment(name=NAME, sections={NAME: CurveSettings}, names=names, check=check)
DRAW = Step(
    name="learning_samples",
    run="gpca.steps.learning_curve:learning_samples",
    inputs={"objects": "objects/{source}.npz"},
    outputs={"samples": "learning_samples/{source}/chunk{chunk}.npz"},
    settings=lambda plan, wildcards: {
        NAME: plan.config[NAME],
        "causes": plan.config["causes"],
        "icp": plan.config["registrations"]["icp"],
    },
    params={"seed": lambda plan, _wildcards: plan.config["seeds"][0]},
    priority=5,
)
LEARN = Step(
    name="learn_from_more",
    run="gpca.steps.learning_curve:learn_from_more",
    inputs={
        "causes": "causes/{*source}/seed{seed}.npz",
        "descriptors": "descriptors/{*source}/seed{seed}.npz",
        "samples": FURTHER,
    },
    outputs={"out": "learning_curve/{source}/seed{seed}.csv"},
    settings=(NAME,),
    priority=4,
)


def read_curves(files: Paths) -> Frame:
    return read_samples(files, lambda path: read_numbers(path, CURVE_COLUMNS, CURVE_COLUMNS[1:]), ("source",))


@numbers("learning_curve.csv", rule="learning_curve_metrics", files=FILES)
def collect(_run: Run, files: Paths) -> Frame:
    """Means over the orders; ``concept`` is the number of samples."""
    means = read_curves(files).groupby(["source", "learner", "samples", "seed"], sort=False)[list(MEASURED)].mean()
    records = [
        (NAME, source, learner, metric, f"{samples:g}", seed, value)
        for (source, learner, samples, seed, metric), value in means.stack().items()
    ]
    return tidy(records, "learning curves")


GUESSING = 25.0  # balanced accuracy in %, of four labels


@figure(
    "Beyond the paper: what made a registration fail",
    "What an observer may reach: learning from more samples",
    """Balanced accuracy and regret on the test samples of Table IX, for learners of more and more registrations of the
    training objects. Besides the runs from other starts, they read what needs no further registration. The band is the
    range over orders of the samples. The dashed line is the truth measured again from other starts; it knows the true
    pose and the clean clouds, so it is no bound that an observer could reach.""",
    after="table9_shown",
    curves=(read_curves, FILES),
)
def learning_curve(run: Run, curves):
    from matplotlib.ticker import NullLocator

    lines = {"trees": ("Extremely randomized trees", BLUE), "gpca": ("GP-CA's classifier", ORANGE)}
    rows = {"balanced_accuracy": "balanced accuracy (%)", "regret": "regret (%)"}
    present = set(curves["source"])
    shown = [name for name in run.sources if name in present]
    page, axes = panels(len(rows), len(shown), 0.6 + 1.5 * len(rows), COLUMN_WIDTH_IN, sharex=True, sharey="row")
    ticks = sorted(curves.loc[curves["learner"] != CEILING, "samples"].unique())
    for column, source in enumerate(shown):
        curve = curves[curves["source"] == source]
        for panel, metric in zip(axes[:, column], rows, strict=True):
            for name, (title, color) in lines.items():
                by_size = 100 * curve[curve["learner"] == name].groupby("samples")[metric].agg(["min", "mean", "max"])
                panel.plot(by_size.index, by_size["mean"], "o-", color=color, markersize=3, label=title)
                panel.fill_between(by_size.index, by_size["min"], by_size["max"], color=color, alpha=0.2, linewidth=0)
            reached = 100 * curve.loc[curve["learner"] == CEILING, metric].mean()
            panel.axhline(reached, color=GRAY, linestyle="--", label="truth from other starts (counterfactual access)")
            if metric == "balanced_accuracy":
                panel.axhline(GUESSING, color=GRAY, linestyle=":", label="guessing")
                panel.set_ylim(0, 100)
            panel.set_xscale("log")
            panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks], rotation=45)
            panel.xaxis.set_minor_locator(NullLocator())
        axes[0, column].set_title(in_lines(run.source_titles[source]))
        axes[-1, column].set_xlabel("training samples")
    for panel, label in zip(axes[:, 0], rows.values(), strict=True):
        panel.set_ylabel(label)
    legend_below(page, axes[0, 0].get_lines(), columns=1)
    return page
