"""Causes of failed registrations whose truth differs from what explainers learn (Table IX, shift)."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any
from warnings import catch_warnings

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import Causes
from gpca.causes.judged import CEILING, MEASURES, Judged, ceiling_of, counted, joined, judged_by, measure
from gpca.causes.settings import Calls
from gpca.declarations import Experiment, Frame, LeftOut, Names, Paths, Plan, Run, Step, Wildcards, numbers, table
from gpca.errors import InputError, with_key
from gpca.evaluation.intervals import ANYTHING, GUESSES, TRIVIAL, Clustered
from gpca.evaluation.measures import POOLED, compared, intervals
from gpca.experiments import diagnosis
from gpca.experiments.cause_tables import AGAIN, POINTS, SECTION, SHOWN
from gpca.experiments.diagnosis import JUDGED, TRAINED
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.container import require_same_samples
from gpca.reporting.sheet import Cell, Row, Sheet, Show, plain_cell, rows_where, show
from gpca.seeds import seed_of_file
from gpca.settings import Bounds, Count, Distinct, read_settings
from gpca.steps.shifts import LABELS, STANDARD, Shift

NAME = "cause_shifts"
PRODUCT = "observed"  # the shift in which the cloud is moved that `gpca explain` moves
MEAN, DROP = "mean", "drop"  # over the shifts, and by how much it is below the truth that was learned
LEAD, FLOOR = 5, -3  # points over the best trained explainer that the re-enactment ought to have, and under any shift
METRICS = ("balanced_accuracy", "auroc_failed", "false_alarm_rate", "dominant_accuracy", "regret")


@dataclass(frozen=True)
class Section:
    """Shifted truths, and the explainers of causes that are asked about them."""

    sources: Distinct[str]
    explainers: Distinct[str]
    truths: dict[str, dict]
    seeds: Count
    test: Annotated[int, Bounds(minimum=6)]
    candidates: Calls


def check(config: dict, _left_out: LeftOut) -> None:
    for name, entry in config[NAME]["truths"].items():
        key = f"{NAME}.truths.{name}"
        if name in (STANDARD, MEAN, DROP):
            raise InputError(f"config key {key}", "is a word of the table", "choose another name")
        with_key(key, lambda entry=entry: read_settings(Shift, entry).truth(config["causes"], {}))


def shifts(config: Mapping[str, Any]) -> dict[str, str]:
    return {name: entry["title"] for name, entry in config[NAME]["truths"].items()}


EXPERIMENT = Experiment(
    name="shifts",
    sections={NAME: Section},
    names=lambda config, sources: {
        "shift": list(shifts(config)),
        "shift_source": list(config[NAME]["sources"]),
        "shift_seed": list(config["seeds"])[: config[NAME]["seeds"]],
    },
    needs=("shift",),
    check=check,
    optional_entries={f"{NAME}.truths": Names("shift")},
    lists={f"{NAME}.sources": "sources", f"{NAME}.explainers": "diagnosis.explainers"},
)


def _settings(plan: Plan, wildcards: Wildcards) -> dict[str, Any]:
    return {
        "causes": plan.config["causes"],
        "icp": plan.config["registrations"]["icp"],
        "drawn": {name: plan.config[NAME][name] for name in ("test", "candidates")},
        "shift": plan.config[NAME]["truths"][wildcards.shift],
    }


OF_SHIFT = "{shift}/{what}/{*shift_source}/seed{*shift_seed}.npz"
EACH = {name: f"cause_shifts/{OF_SHIFT}".replace("{what}", name) for name in ("causes", "descriptors", "reenactments")}
DRAW = Step(
    name="draw_shift",
    run="gpca.steps.shifts:draw",
    inputs={"objects": "objects/{*shift_source}.npz"},
    outputs={"causes": EACH["causes"]},
    settings=_settings,
)
OBSERVE = Step(
    name="observe_shift",
    run="gpca.steps.shifts:observe",
    inputs={"causes": EACH["causes"]},
    outputs={"descriptors": EACH["descriptors"], "reenactments": EACH["reenactments"]},
    settings=lambda plan, wildcards: (
        _settings(plan, wildcards) | {name: plan.config["diagnosis"][name] for name in ("descriptors", "reenactment")}
    ),
)
DIAGNOSE = Step(
    name="diagnose_shifts",
    run="gpca.steps.shifts:diagnose",
    inputs={
        **{name: f"{name}/{{*source}}/seed{{seed}}.npz" for name in EACH},
        "encoders": "cause_encoders/{*source}/seed{seed}.pt",
        "embeddings": "cause_embeddings/{*source}/seed{seed}.npz",
        "further": diagnosis.FURTHER,
        **{
            f"shifted_{name}": files.replace("{shift}", "{*shift}").replace("{*shift_seed}", "{seed}")
            for name, files in EACH.items()
        },
    },
    outputs={"predictions": "cause_shifts/diagnoses/seed{seed}.csv"},
    settings=lambda plan, wildcards: {
        **plan.config["diagnosis"],
        "explainers": {name: plan.config["diagnosis"]["explainers"][name] for name in plan.config[NAME]["explainers"]},
    },
    params={"source": NAME, "sources_asked": lambda plan, wildcards: list(plan.config[NAME]["sources"])},
    modules=lambda plan: diagnosis.explaining_modules(plan, plan.config[NAME]["explainers"]),
)


@numbers(
    "shifts.csv",
    prediction_files="cause_shifts/diagnoses/seed{shift_seed}.csv",
    causes_files=diagnosis.CAUSES_FILES.replace("{source}", "{shift_source}").replace("{seed}", "{shift_seed}"),
    shifted_files="cause_shifts/{shift}/causes/{shift_source}/seed{shift_seed}.npz",
)
def collect(run: Run, prediction_files: Paths, causes_files: Paths, shifted_files: Paths) -> Frame:
    """Measures with intervals over families and seeds; the concept is the shift, all sources are pooled."""
    truths: dict[tuple[str, str, int], Causes] = {}
    for name, paths in ((STANDARD, causes_files), ("", shifted_files)):
        for file in map(Path, paths):
            source, seed = file.parent.name, seed_of_file(file)
            causes = Causes.load(file, (source, seed))
            truths[name or file.parts[-4], source, seed] = causes.subset(causes.rows("test"))
    judged: dict[str, dict[tuple[str, str, int], Judged]] = {
        CEILING: {key: ceiling_of(truth, key[2]) for key, truth in truths.items()}
    }
    for path in prediction_files:
        seed = seed_of_file(path)
        for (shift, source, explainer), rows in read_predictions(path, labels=LABELS).groupby(list(LABELS), sort=False):
            truth = truths[shift, source, seed]
            require_same_samples(path, rows, truth.registrations.arrays, "causes", ("sample",))
            judged.setdefault(str(explainer), {})[shift, source, seed] = judged_by(rows, truth, seed)
    by_shift = {
        name: {
            shift: joined(each[key] for key in sorted(each) if key[0] == shift)
            for shift in dict.fromkeys(shift for shift, _, _ in truths)
        }
        for name, each in judged.items()
    }
    return intervals(measured(by_shift), "shifts")


def measured(judged: Mapping[str, Mapping[str, Judged]]) -> list[tuple]:
    """Rows of all measures, of samples by explainer and shift: of each shift, of the mean over them, and its `DROP`."""
    first = next(iter(judged.values()))
    whole = joined(first.values())
    draws = Clustered.drawn(whole.seed, whole.instance, "shift intervals")
    shift_N = np.repeat(list(first), [len(each) for each in first.values()])
    values = {
        name: _with_mean({shift: measure(each, draws.weights[:, shift_N == shift]) for shift, each in of.items()})
        for name, of in judged.items()
    }
    rows = []
    for part, metric in product((*first, MEAN, DROP), METRICS):
        inside_N = shift_N == part if part in first else shift_N != STANDARD
        how, subset = MEASURES[metric], draws.subset(inside_N & counted(whole, metric))
        value = {name: of[part][metric] for name, of in values.items() if metric in of[part]}
        limits = ANYTHING if part == DROP else how.limits
        against = {} if part == DROP else {TRAINED: diagnosis.trained_rivals}
        rows += compared((diagnosis.TABLE, POOLED), metric, part, value, subset, limits, against, how.least_is_best)
    return rows


def _with_mean(by_shift: dict[str, dict[str, np.ndarray]]) -> dict[str, dict[str, np.ndarray]]:
    shifted = [of for shift, of in by_shift.items() if shift != STANDARD]
    with catch_warnings(category=RuntimeWarning, action="ignore"):  # of draws in which no shift has a measure
        mean = {metric: np.nanmean([of[metric] for of in shifted], axis=0) for metric in shifted[0]}
    return by_shift | {MEAN: mean, DROP: {metric: mean[metric] - by_shift[STANDARD][metric] for metric in mean}}


SHOWN_OF_SHIFTS = {
    "standard": show("balanced_accuracy", "As learned (%)", STANDARD),
    MEAN: show("balanced_accuracy", "Mean over shifts (%)", MEAN),
    DROP: show("balanced_accuracy", "Change (points)", DROP, **POINTS),
    "lead": show("balanced_accuracy", "Over trained (points)", MEAN, where={"against": TRAINED}, **POINTS),
    "false_alarm_rate": show("false_alarm_rate", "False alarms (%)", MEAN, least_is_best=True),
    "auroc_failed": show("auroc_failed", "AUROC", MEAN, factor=1, decimals=3, limits=(0.0, 1.0)),
}


def reached(measures: Frame, titles: Mapping[str, str], explainers: Mapping[str, str]) -> str:
    """Sentence, by titles, on whether the re-enactment leads as was declared; empty if no other is there to be led."""
    leads = rows_where(measures, metric="balanced_accuracy", method=JUDGED, against=TRAINED).set_index("concept")
    if MEAN not in leads.index:
        return ""
    value, low, high = (100 * leads.loc[MEAN, ["value", "low", "high"]]).tolist()
    below = [title for shift, title in titles.items() if shift in leads.index and 100 * leads["value"][shift] < FLOOR]
    verdict = "reached" if value >= LEAD and low > 0 and not below else "not reached"
    because = ", as the interval contains 0" if low <= 0 <= high else ""
    missed = f"; below {FLOOR} under: {', '.join(below)}" if below else ""
    names = [explainers[name] for name in (JUDGED, leads.loc[MEAN, "other"])]
    ahead, behind = names if value >= 0 else names[::-1]
    least, most = (low, high) if value >= 0 else (-high, -low)
    return (
        f"The aim is {verdict}{because}: a lead of {LEAD} points on the mean over shifts over the best explainer that "
        f"is trained and reads no re-enactment, its interval above 0, and no shift below {FLOOR}. {ahead} leads "
        f"{behind} by {abs(value):.1f} ({least:.1f} to {most:.1f}){missed}."
    )


def best_of_each_kind_first(measures: Frame) -> list[str]:
    """Explainers by value: the re-enactment, the best that is trained, the best that is trivial, then all others."""
    names = measures[measures["method"] != CEILING].sort_values("value", ascending=False)["method"].tolist()
    kinds = {JUDGED}, {*diagnosis.trained_rivals(JUDGED, names)} - {*TRIVIAL}, {*TRIVIAL}
    first = [name for kind in kinds for name in [each for each in names if each in kind][:1]]
    return list(dict.fromkeys(first + names))


def knows(name: str) -> str:
    """What an explainer knows of the generator that the samples of Table IX are drawn by."""
    if name in GUESSES:
        return "nothing"
    if name == "rule":
        return "its limits"
    sees = explainer_entry(name, CAUSES).sees
    further = ["its starts and limits, and every registration method"] if "reenactment" in sees else []
    learned = ["its samples"] if name != "reenact" else []
    return "; ".join([*learned, *further])


@table(
    SECTION,
    "Table IX, shift",
    """The explainers of Table IX, trained on its samples, are asked about registrations whose truth is generated in
    other ways: other occlusion, registration methods, models, noise, clutter, and the other cloud moved.""",
    after="table9_shown",
    measures="shifts.csv",
)
def table9_shift(run: Run, measures):
    explainers, titles = diagnosis.cause_titles(run.config), shifts(run.config)
    names, shown = run.config[NAME]["explainers"], ", ".join(titles.values())
    rows = [Row([(name, explainers[name]), (knows(name),) * 2], {"method": name}) for name in names]
    rows.append(Row([(CEILING, AGAIN[CEILING]), ("truth",) * 2], {"method": CEILING}, rival=False))
    columns = {PRODUCT: show("balanced_accuracy", "As a user registers (%)", PRODUCT)} | SHOWN_OF_SHIFTS
    sheet = Sheet("table9_shift", {"explainer": "Explainer", "knows": "Knows"}, rows, columns, measures)
    return sheet.table(
        "Causes of failure under shifts of the truth" + run.stand_ins(),
        "metric",
        [
            *filter(None, [reached(measures, titles, explainers)]),
            "As a user registers: balanced accuracy where the observed cloud is moved. As learned: on the test samples "
            f"of Table IX, where the model is. Mean over shifts, also of false alarms and AUROC: {shown}. Over "
            "trained: minus the best other explainer that is trained and reads no re-enactment, on the same draws.",
            "Knows: what is known of the generator of Table IX. Its samples: those that are learned from, of all "
            "sources together. Of a shift, the re-enactment is given the method and which cloud moved alone.",
            f"{sheet.over()}.",
        ],
        bold=[key for key in columns if key not in (DROP, "lead")],
    )


@table(
    SECTION,
    "Table IX, shift by shift",
    """Balanced accuracy under each shift of the truth, and the lead of the re-enactment without training over the best
    explainer that is trained and reads no re-enactment.""",
    after="table9_shift",
    measures="shifts.csv",
)
def table9_shifts(run: Run, measures):
    shifted = shifts(run.config)
    first = {PRODUCT: shifted.pop(PRODUCT) + ", as in `gpca explain`"} if PRODUCT in shifted else {}
    titles = first | {STANDARD: "As learned, model moved"} | shifted | {MEAN: "Mean over shifts"}
    balanced = {"metric": "balanced_accuracy"}
    names = best_of_each_kind_first(rows_where(measures, concept=MEAN, against="", **balanced))
    lead = balanced | {"method": JUDGED, "against": TRAINED}
    columns = {"samples": SHOWN["samples"], "lead": Show("Lead of the re-enactment (points)", where=lead, **POINTS)}
    columns |= {
        name: Show(f"{explainer_entry(name, CAUSES).title} (%)", where=balanced | {"method": name}, interval=False)
        for name in names
    }
    rows = [Row([each], {"concept": each[0]}) for each in titles.items()]

    def counts(row: Row, subset: Frame) -> dict[str, Cell]:
        return {"samples": plain_cell(n := int(subset["samples"].max()), int(subset["seeds"].max()), n)}

    sheet = Sheet("table9_shifts", {"shift": "Truth"}, rows, columns, measures, more=counts)
    return sheet.table(
        "Balanced accuracy by shift of the truth" + run.stand_ins(),
        "metric",
        [f"n: judged samples. Bold: best explainer under a shift. {sheet.over()}."],
        bold_across=names,
    )
