"""Re-enactments: one of them as a figure, and what each part of the truth would add to them (docs/causes.md)."""

from dataclasses import dataclass
from math import inf
from typing import Any

from gpca.causes.judged import read_judged
from gpca.causes.settings import CauseSettings
from gpca.declarations.experiment import Experiment
from gpca.declarations.plan import Run
from gpca.declarations.result import Frame, Paths, figure, numbers, table
from gpca.declarations.step import Step
from gpca.evaluation.intervals import REPEATS
from gpca.evaluation.measures import POOLED
from gpca.experiments.cause_figures import draw_reenactment
from gpca.experiments.cause_tables import AGAIN, SECTION, SHOWN, counts_and_calls
from gpca.experiments.diagnosis import by_source, compared_by_source, with_pooled
from gpca.objects.entry import dataset_of
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.reenactment.settings import EVERYTHING, KNOWN, NOTHING, ReenactmentSettings
from gpca.reporting.sheet import Sheet, crossed, show
from gpca.reporting.tables.table import Column
from gpca.reporting.words import plural
from gpca.settings import Count, Distinct, read_settings

MEASURED = ("balanced_accuracy", "dominant_accuracy", "auroc_failed", "regret", "false_alarm_rate")
IN_WORDS = {POSE: "true pose", NOISE: "points without noise", OVERLAP: "missing surface"}  # truth about each cause


@dataclass(frozen=True)
class Section:
    """Sources whose test samples are re-enacted with parts of the truth, and the number of seeds."""

    sources: Distinct[str]
    seeds: Count


EXPERIMENT = Experiment(
    name="reenactment",
    sections={"oracles": Section},
    names=lambda config, sources: {
        "known": list(KNOWN),
        "oracle_source": list(config["oracles"]["sources"]),
        "oracle_seed": list(config["seeds"])[: config["oracles"]["seeds"]],
    },
    lists={"oracles.sources": "sources"},
)
ORACLES = Step(
    name="oracles",
    run="gpca.steps.causes:oracles",
    inputs={"objects": "objects/{source}.npz", "causes": "causes/{source}/seed{seed}.npz"},
    outputs={"predictions": "oracles/{source}/{*known}/seed{seed}.csv"},
    settings=lambda plan, wildcards: {
        "reenactment": plan.config["diagnosis"]["reenactment"],
        "causes": plan.config["causes"],
        "icp": plan.config["registrations"]["icp"],
    },
)


@numbers(
    "oracle_intervals.csv",
    prediction_files="oracles/{oracle_source}/{known}/seed{oracle_seed}.csv",
    causes_files="causes/{oracle_source}/seed{oracle_seed}.npz",
)
def collect_oracles(run: Run, prediction_files: Paths, causes_files: Paths) -> Frame:
    """`MEASURED` by source and by what is known, and differences from the estimate, with intervals."""
    samples_of = by_source(with_pooled(read_judged(prediction_files, causes_files)))
    against = {"estimate": lambda name, names: [NOTHING]}
    return compared_by_source(samples_of, "oracle intervals", MEASURED, against)


def in_words(name: str) -> str:
    """Words for what is known, such as ``true pose + missing surface``."""
    known = [words for cause, words in IN_WORDS.items() if cause in KNOWN[name]]
    return {NOTHING: "nothing: the estimate", EVERYTHING: "all three"}.get(name) or " + ".join(known)


@figure(
    SECTION,
    "One failed registration, re-enacted by an observer",
    """Above, what ICP made of the observed cloud, where the likeliest hypothesis of the true pose puts it in the model,
    with its probability, and the clouds that are rebuilt there. Below, the mean error of registrations with each
    subset of the causes: measured, with the truth (bars), and re-enacted under each hypothesis (marks, the larger the
    more probable). The title says which cause these errors name. Shown is the failed test sample of median margin
    with several causes and several hypotheses.""",
    after="causes_example",
    objects_npz="objects/{shown_source}.npz",
    causes_npz="causes/{shown_source}/seed{first_seed}.npz",
    reenactments_npz="reenactments/{shown_source}/seed{first_seed}.npz",
)
def reenactment(run: Run, objects_npz, causes_npz, reenactments_npz):
    source = run.config["figures"]["source"]
    truth = CauseSettings.from_dict(dict(run.config["causes"]), dict(run.config["registrations"]["icp"]))
    settings = read_settings(ReenactmentSettings, dict(run.config["diagnosis"]["reenactment"]))
    shown = run.source_titles[source], dataset_of(run.config["sources"][source])
    return draw_reenactment(objects_npz, causes_npz, reenactments_npz, truth, settings, *shown)


@table(
    SECTION,
    "Table IX by what a re-enactment knows",
    """The untrained re-enactment as it is, and with parts of the truth: the true pose, the observed points without
    their noise, the surface that was missing. What a row gains over the estimate is what a better estimate of that part
    could gain at most, with everything else as it is.""",
    after="table9_features",
    oracles="oracle_intervals.csv",
)
def table9_oracle(run: Run, oracles):
    titles = {POOLED: "All together"} | run.source_titles
    gained = {"balanced_accuracy": 100.0, "dominant_accuracy": 100.0, "regret": inf}  # with the limits of the gain
    columns: dict[str, Column] = {}
    for metric in ("balanced_accuracy", "dominant_accuracy", "auroc_failed", "regret", "false_alarm_rate", "samples"):
        columns[metric] = SHOWN[metric]
        if limit := gained.get(metric):
            look: dict[str, Any] = {"where": {"against": "estimate"}, "limits": (-limit, limit)}
            columns[f"{metric}_gain"] = show(metric, "Over the estimate (points)", **look)
    rows = crossed(("source", titles), ("method", {name: in_words(name) for name in KNOWN} | AGAIN))
    heads = {"source": "Dataset", "known": "Known"}
    sheet = Sheet("table9_oracle", heads, rows, columns, oracles, more=counts_and_calls({}))
    notes = (
        "Known: the hypothesis of the true pose is right; or each observed point is known without its noise, and "
        "how noisy it was; or the surface that was missing is known. The rest is estimated as ever, without any "
        "training. No observer knows any of this.",
        "n: test samples that are judged; borderline ones are left out. The measures are those of Table IX. Over "
        "the estimate: minus the first row of the dataset, on the same draws; regret is the better, the smaller. "
        f"Over {plural(sheet.seeds, 'seed')}; in brackets the 95 % interval of a bootstrap over objects and "
        f"seeds ({REPEATS} draws).",
        "The last row is the truth measured again from other starts, on the whole surface of the object: the rows "
        "above know the model's points alone.",
    )
    caption = "What a re-enactment would say if it knew parts of the truth" + run.stand_ins()
    return sheet.table(caption, "metric", notes)
