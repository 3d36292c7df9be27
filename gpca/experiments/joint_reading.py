"""One joint reading of all that the paper leaves open: what one consistent protocol reproduces (Table XVI)."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from gpca.comparison import joint_reading as joint
from gpca.comparison.claims import ThreeDigits
from gpca.comparison.joint_reading import DEVELOPMENT, EVALUATED, EVALUATION, JUDGED, PROTOCOL, SEVERITIES
from gpca.comparison.published import read_published
from gpca.comparison.readings import read_judged
from gpca.comparison.verdicts import Tolerance
from gpca.declarations import Experiment, Frame, LeftOut, Paths, Plan, Run, Step, numbers, table
from gpca.errors import InputError
from gpca.evaluation.measures import read_all_metrics, read_metrics, tidy
from gpca.experiments import reading_words
from gpca.experiments.active_learning import learning_settings
from gpca.experiments.specification_curve import plain_cells, retrained_on, stand_ins
from gpca.explainers.registry import explainer_module
from gpca.io.csv_file import ANY, read_csv
from gpca.objects.entry import Name, SourceEntry, title_of
from gpca.reporting.sheet import TableBuilder, rows_where
from gpca.settings import Bounds, Count

DevelopmentSeed = Annotated[int, Bounds(minimum=100)]  # no other run has them


@dataclass(frozen=True, kw_only=True)
class Section:
    """How a joint reading is searched."""

    source: Name  # of the development objects, in no row of any table
    objects: SourceEntry
    stands_for: Name  # the source whose printed numbers it is compared with
    seeds: tuple[DevelopmentSeed, ...]  # of development; none for a run without a joint reading
    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)]  # of each source and seed for Monte-Carlo ICP, at most
    batch: Count  # labels of a round
    labels: Count  # in all
    deals: Count  # permutations of the printed numbers, for the chance
    choices: joint.Grid  # values of each choice, the protocol's first


def check(config: dict, _left_out: LeftOut) -> None:
    """Check that there are encoders of all severities, and that the development objects are nobody else's."""
    section = config["joint_reading"]
    if not section["seeds"]:
        return
    if section["source"] in config["sources"]:
        fault = f"'{section['source']}' is a source of the run too"
        raise InputError("config key joint_reading.source", fault, "set joint_reading.seeds: []")
    if set(section["choices"][SEVERITIES]) - {PROTOCOL} and not config["readings"]["encoders"]:
        fault = "needs encoders that learn from other severities"
        raise InputError("config key joint_reading.choices.severities", fault, "raise readings.encoders")


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    section = config["joint_reading"]
    is_run = section["stands_for"] in sources and bool(section["seeds"])
    return {
        "development_seed": list(section["seeds"]) if is_run else [],
        "development_source": section["source"] if is_run else "",
        "joint_severities": list(section["choices"][SEVERITIES]) if is_run else [],
        "retrained_source": [*sources, section["source"]] if is_run else list(sources),
    }


EXPERIMENT = Experiment(
    name="joint_reading", sections={"joint_reading": Section}, needs=("development_seed",), names=names, check=check
)


def _sections(plan: Plan) -> dict[str, Any]:
    config, section = plan.config, plan.config["joint_reading"]
    return {
        "sizes": {"samples": section["samples"]},
        "gpca_paper": config["explainers"].get("gpca_paper") or {},
        "active_learning": learning_settings(plan),
        "labels": {name: section[name] for name in ("batch", "labels")},
        "uncertainty": config["uncertainty"].get("additive", {}),
        "icp": config["registrations"]["icp"],
    }


def _step(**declared: Any) -> Step:
    return Step(when=lambda plan: bool(plan.names["development_seed"]), priority=9, **declared)


MEASURE = _step(
    name="measure_joint",
    run="gpca.steps.joint_readings:measure",
    inputs={
        "objects": "objects/{development_source}.npz",
        "sets": "retrained/{severities}/{development_source}/seed{seed}.npz",
    },
    outputs={"out": "joint_measures/{severities}/seed{seed}.csv"},
    where={"severities": "joint_severities"},
    settings=lambda plan, wildcards: {
        "choices": plan.config["joint_reading"]["choices"],
        "registrations": retrained_on(plan.config, wildcards.severities),
        **_sections(plan),
    },
    params={"source": lambda plan, wildcards: plan.names["development_source"]},
    modules=lambda plan: [explainer_module("learner_forest")],
)
CHOOSE = _step(
    name="choose_joint",
    run="gpca.steps.joint_readings:choose",
    inputs={"measured": "joint_measures/{*joint_severities}/seed{*development_seed}.csv"},
    outputs={name: f"joint_choice/{name}.csv" for name in ("choice", "best", "scores")},
    settings=("joint_reading.choices", "joint_reading.stands_for", "joint_reading.deals", "comparison.tolerances"),
)
APPLY = _step(
    name="apply_joint",
    run="gpca.steps.joint_readings:apply",
    inputs={
        "choice": "joint_choice/choice.csv",
        "objects": "objects/{source}.npz",
        "sets": lambda plan, wildcards: [
            f"shifted/{{source}}/seed{seed}.npz" for seed in plan.run.seeds(plan.config["readings"]["seeds"])
        ],
        "other_sets": lambda plan, wildcards: [
            f"retrained/{severities}/{{source}}/seed{seed}.npz"
            for severities in plan.names["joint_severities"]
            if severities != PROTOCOL
            for seed in plan.run.seeds(plan.config["readings"]["encoders"])
        ],
    },
    outputs={"out": "joint_readings/{source}.csv"},
    settings=lambda plan, wildcards: {
        "registrations": plan.config["registrations"],
        "severities": {name: {"severities": each} for name, each in plan.config["readings"]["severities"].items()},
        **_sections(plan),
    },
    modules=lambda plan: [explainer_module("learner_forest")],
)


@numbers(
    "joint_verdicts.csv",
    "joint_scores.csv",
    rule="judge_joint",
    values="joint_readings/{source}.csv",
    comparison="comparison.csv",
    readings="reading_verdicts.csv",
    development="joint_choice/scores.csv",
)
def judge_joint(run: Run, values: Paths, comparison: Path, readings: Path, development: Path) -> tuple[Frame, Frame]:
    """Values of the joint reading, of the run and of all readings beside the printed ones; scores of all samples."""
    import pandas as pd

    tolerances = {unit: Tolerance(**given) for unit, given in run.config["comparison"]["tolerances"].items()}
    measured = read_all_metrics(values)
    asked = joint.numbers_asked(read_published(), measured["source"].unique())
    judged = read_csv(comparison, ("table", "row", "column", "reproduced", "at_least"), others=ANY)
    deals = run.config["joint_reading"]["deals"]
    rows, records = joint.judge(asked, measured, judged, read_judged(readings), tolerances, deals)
    scores = [(table, EVALUATION, method, metric, "all", 0, float(value)) for table, method, metric, value in records]
    return (
        pd.DataFrame(rows, columns=list(joint.VERDICT_COLUMNS)),
        pd.concat([read_metrics(development), tidy(scores, "joint reading")]),
    )


COLUMNS = {"published": "Paper", "reproduced": "Protocol", "joint": "Joint reading"}
HEADS = {
    **{"number": "Number", "unit": "Unit", "close": "Protocol close", "joint_close": "Joint reading close"},
    "readings": "Other readings that are close",
}
KNOBS = {"low": "knobs at the lower ends", "middle": "knobs at the middles", "high": "knobs at the upper ends"}


@table(
    "What the paper leaves unstated",
    "Table XVI: one reading of all tables",
    """The choices that the paper leaves open and that touch several tables, searched together: the reading with the
    largest share of printed means that come close, found on other objects and seeds and then run once.""",
    verdicts=(joint.read_verdicts, "joint_verdicts.csv"),
    scores="joint_scores.csv",
    choice=(joint.read_choices, "joint_choice/choice.csv"),
    needs=("development_seed",),
)
def table16_joint_reading(run: Run, verdicts: Frame, scores: Frame, choice: Frame):
    table = TableBuilder("table16_joint_reading", HEADS)
    for row in verdicts.itertuples():
        key = (row.table, row.row, row.column)
        count = f"{row.readings_close:.0f} of {row.readings:.0f}" if row.readings else "none was run"
        labels = (
            (" / ".join(key), ", ".join(key)),
            (row.unit, row.unit),
            *(("yes" if is_close else "no",) * 2 for is_close in (row.close, row.joint_close)),
            (f"{row.readings_close:.0f}/{row.readings:.0f}", count),
        )
        table.add_row(labels, plain_cells({name: getattr(row, name) for name in COLUMNS}, row.n))
    never = ~(verdicts["close"] | verdicts["joint_close"] | (verdicts["readings_close"] > 0))
    entry = run.config["joint_reading"]["objects"]
    development = title_of({"title": entry["title"], "stand_in": entry.get("stand_in", entry["kind"] == "procedural")})
    chosen = dict(zip(choice["choice"], choice["value"], strict=True))
    severities, knobs = chosen.pop(SEVERITIES), KNOBS[chosen.pop("knobs")]
    severities = "the protocol's perturbations" if severities == PROTOCOL else f"{severities} perturbations"
    words = ", ".join([severities, *(reading_words.value(*each) for each in chosen.items()), knobs])
    by_samples = rows_where(scores, table="all").set_index(["source", "method", "metric"])["value"]

    def sentence(samples: str, method: str, subject: str) -> str:
        score = by_samples[samples, method]
        largest = "the largest share would be" if samples == DEVELOPMENT else "it would be"
        return (
            f"{subject}: {score['close']:.0f} of {score['numbers']:.0f} numbers are close, {100 * score['share']:.0f} "
            f"% with each table weighted once; {largest} {100 * score['expected_unit']:.0f} % if printed numbers "
            f"changed places within the unit of a table (p = {score['p_unit']:.2f}), "
            f"{100 * score['expected_column']:.0f} % within its columns (p = {score['p_column']:.2f})."
        )

    there = by_samples[DEVELOPMENT, EVALUATED]
    return table.build(
        "The paper's Tables I to V under one reading of all that they leave open" + stand_ins(run),
        "value",
        {name: ThreeDigits(title) for name, title in COLUMNS.items()},
        (
            f"The joint reading: {words}. It was found on {development}; the paper states none.",
            sentence(DEVELOPMENT, EVALUATED, "There, of what is printed of the source that they stand for"),
            f"Of {there['readings']:.0f} readings, {there['equals']:.0f} have that share there, and the first of them "
            f"is taken; the protocol's own has {100 * there['share_of_protocol']:.0f} %.",
            sentence(EVALUATION, EVALUATED, "Here"),
            sentence(EVALUATION, JUDGED, "The protocol that is judged"),
            f"No reading of ours, alone or joint, comes close to {int(never.sum())} of the {len(verdicts)} numbers.",
            "Close: the mean is within the second tolerance (docs/comparison.md), whatever its interval. Of a range, "
            "Paper is the lower end. Values are in the row's unit.",
        ),
    )
