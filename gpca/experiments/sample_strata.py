"""Diagnoses of parts of the test samples: by margin, number of causes, symmetry, error, state and what is shown."""

from itertools import product
from math import inf

import numpy as np

from gpca.causes.judged import CEILING, Judged, decision_measures, read_judged
from gpca.causes.truth import ALL, BORDERLINE, FAILED, NOMINAL
from gpca.declarations import Frame, Paths, Run, numbers, table
from gpca.evaluation.intervals import REPEATS, Clustered
from gpca.evaluation.measures import POOLED, intervals
from gpca.experiments import diagnosis
from gpca.experiments.cause_tables import AGAIN, SECTION
from gpca.reporting.sheet import Column, Row, Sheet, Show, plain_cell, plural, show, where

DECISIONS = {"named_right": ("right", 100.0), "regret": ("regret", inf)}  # in words, and the largest
SMALL_MARGIN, LARGE_MARGIN = 0.01, 0.03  # diameters
SMALL_ERROR, LARGE_ERROR = 0.05, 0.10
SIMPLE = ("reenact", "rule", "most_frequent", "chance")  # explainers that are not trained
PAPER = "gpca"  # GP-CA on the paper's input


def strata_of(samples: Judged) -> dict[tuple[str, str], np.ndarray]:
    """Kind and stratum -> mask (N,) of its samples; all but the states divide the failed."""
    nominal_N = samples.label == NOMINAL
    failed_N = ~nominal_N & (samples.label != BORDERLINE)
    number_of = {  # of a stratum, in the order of `KINDS`
        "margin": np.digitize(samples.margin, (SMALL_MARGIN, LARGE_MARGIN)),
        "causes": np.maximum(samples.causes.sum(axis=1), 1) - 1,
        "symmetry": np.where(samples.symmetric, 0, 1),
        "error": np.digitize(samples.error[:, ALL], (SMALL_ERROR, LARGE_ERROR)),
        "shown": np.where(samples.shown == FAILED, 0, 1),
    }
    return {("state", "nominal"): nominal_N, ("state", "failed"): failed_N} | {
        (kind, stratum): (number_N == number) & failed_N
        for kind, number_N in number_of.items()
        for number, stratum in enumerate(KINDS[kind][1])
    }


@numbers("cause_strata.csv", prediction_files=diagnosis.DIAGNOSES, causes_files=diagnosis.CAUSES_FILES)
def collect_strata(run: Run, prediction_files: Paths, causes_files: Paths) -> Frame:
    """Decisions of every explainer in every stratum that has samples, over all sources and seeds, with intervals."""
    samples_of = diagnosis.by_source(diagnosis.with_pooled(read_judged(prediction_files, causes_files)))
    source = POOLED if POOLED in samples_of else next(iter(samples_of))
    samples = next(iter(samples_of[source].values()))
    draws = Clustered.drawn(samples.seed, samples.instance, "cause strata", source)
    naming = {explainer: each for explainer, each in samples_of[source].items() if each.names_causes}
    rows: list[tuple] = []
    for (kind, stratum), mask_N in strata_of(samples).items():
        if mask_N.any() and naming:
            inside = {explainer: each.subset(mask_N) for explainer, each in naming.items()}
            part = f"{kind}_{stratum}"
            rows += diagnosis.compared_samples(source, inside, draws.subset(mask_N), decision_measures, DECISIONS, part)
    return intervals(rows, "diagnoses")


def _between(small: float, large: float) -> dict[str, str]:
    low, high = f"{100 * small:g}", f"{100 * large:g}"
    return {"small": f"below {low} % d", "middle": f"{low} to {high} % d", "large": f"{high} % d or more"}


KINDS = {
    "state": ("State", {"nominal": "nominal", "failed": "failed"}),
    "margin": ("Failed: the largest φ exceeds the next by", _between(SMALL_MARGIN, LARGE_MARGIN)),
    "causes": ("Failed: number of causes", {"one": "one", "two": "two", "three": "three"}),
    "symmetry": ("Failed: object", {"symmetric": "symmetric (ADD-S)", "other": "other (ADD)"}),
    "error": ("Failed: mean error", _between(SMALL_ERROR, LARGE_ERROR)),
    "shown": ("Failed: the registration shown", {"failed": "failed itself", "other": "did not fail itself"}),
}
SHOWN_STATES = {
    "state_accuracy": show("state_accuracy", "State, mean (%)"),
    "state_accuracy_shown": show("state_accuracy_shown", "State, shown (%)"),
    "auroc_failed": show("auroc_failed", "AUROC, mean", factor=1, decimals=3, limits=(0.0, 1.0)),
    "auroc_failed_shown": show("auroc_failed_shown", "AUROC, shown", factor=1, decimals=3, limits=(0.0, 1.0)),
}


@table(
    SECTION,
    "Table IX by parts of the samples",
    """The same answers by how clear the case is: whether one cause adds more than the others, how many there are,
    whether the object is symmetric, how far the registration is off, and whether the one that is shown failed.""",
    after="table9_causes",
    strata="cause_strata.csv",
)
def table9_strata(run: Run, strata):
    explainers = diagnosis.cause_titles(run.config)
    failed = where(strata, {"concept": "state_failed", "metric": "regret", "against": ""})
    regret = failed.set_index("method")["value"]
    trained = [name for name in explainers if name in regret.index and name not in (*SIMPLE, PAPER)]
    best = sorted(trained, key=lambda name: regret[name])[:1]
    ordered = (SIMPLE[0], *best, PAPER, *SIMPLE[1:])
    names = [name for name in ordered if name in explainers and name in regret.index]
    chosen = {name: explainers[name] for name in names} | AGAIN
    columns: dict[str, Column] = {"samples": Column("n", decimals=0, interval=False, limits=(0.0, inf))}
    for (metric, (words, most)), (name, title) in product(DECISIONS.items(), chosen.items()):
        of, interval = {"method": name, "metric": metric}, metric == "named_right" and name != CEILING
        columns[f"{name}_{metric}"] = Show(f"{title}: {words} (%)", interval=interval, limits=(0.0, most), where=of)
    rows = [
        Row([(kind, title), stratum], {"concept": f"{kind}_{stratum[0]}"})
        for kind, (title, strata_of_kind) in KINDS.items()
        for stratum in strata_of_kind.items()
    ]

    def counts(row: Row, subset: Frame) -> dict:
        last = subset[subset["method"] == list(chosen)[-1]].iloc[-1]
        return {"samples": plain_cell(int(last["samples"]), int(last["seeds"]), int(last["samples"]))}

    sheet = Sheet("table9_strata", {"kind": "Part", "stratum": "of the samples"}, rows, columns, strata, more=counts)
    notes = (
        f"All datasets and {plural(sheet.seeds, 'seed')} together, without borderline samples. In brackets: "
        f"the 95 % interval of {REPEATS} bootstrap draws over objects and seeds.",
        "Right: share whose label is named, where for a failure any cause counts whose φ is within the limit of a "
        "cause of the largest. Regret: of the failed, the share of the error that removing the best single cause "
        "would take away and removing the named one does not; who names nominal removes nothing.",
    )
    caption = "Parts of the registrations with measured causes" + run.stand_ins()
    return sheet.table(caption, "explainer", notes)


@table(
    SECTION,
    "Table IX by the registration that is shown",
    """The truth is a mean over many starts, but an explainer is shown a single registration, which may be right where
    the mean is not. `gpca explain` says of its result what the judge of the result says here, which learned from the
    errors that are shown; the other explainers learned from the means.""",
    after="table9_strata",
    intervals="cause_intervals.csv",
)
def table9_shown(run: Run, intervals):
    present = set(intervals["source"])
    pooled = POOLED if POOLED in present else next(name for name in run.sources if name in present)
    rows = [
        Row([explainer], {"source": pooled, "method": explainer[0]}, rival=explainer[0] != CEILING)
        for explainer in (diagnosis.cause_titles(run.config) | AGAIN).items()
    ]
    sheet = Sheet("table9_shown", {"explainer": "Explainer"}, rows, SHOWN_STATES, intervals)
    counts = where(intervals, {"source": pooled}).groupby("metric")["samples"].max()
    notes = (
        f"Mean: {counts['state_accuracy']:.0f} test samples whose mean error over starts is nominal or failed. "
        f"Shown: {counts['state_accuracy_shown']:.0f} whose registration, the one that the explainer sees, has an "
        "error of its own below the nominal limit or above that of failures.",
        "State: mean share of the nominal and of the failed that is called so. AUROC: of failed against nominal. "
        f"All datasets and {plural(sheet.seeds, 'seed')} together. In brackets: the 95 % interval of "
        f"{REPEATS} bootstrap draws over objects and seeds. Bold: best explainer.",
    )
    caption = "Who says that a registration failed: by the mean over starts, and by the registration that is shown"
    return sheet.table(caption + run.stand_ins(), "metric", notes, bold=SHOWN_STATES)
