"""Classifiers on samples unlike those of the training, and how useful their uncertainty is (Table V)."""

from collections.abc import Iterable, Mapping
from functools import partial
from itertools import product
from math import inf
from typing import Annotated, Any

import numpy as np

from gpca.attribution import diagnostics
from gpca.attribution import learner_predictions as predicted
from gpca.declarations import ByName, Experiment, Frame, LeftOut, Names, Paths, Run, Step, numbers, table
from gpca.encoders.registry import EncoderChanges, require_draws
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, Clustered, intervals, tidy
from gpca.experiments.explained import explainer_settings, require_explained
from gpca.explainers.registry import explainer_entry, explainer_module, explainers
from gpca.pairs.perturbation import Severities
from gpca.pairs.shifted_sets import DISTANCES, TRAINED_ON, with_training_like
from gpca.reporting.sheet import Row, Sheet, Show, Table, crossed, in_words, over_clusters, rows_where, show, span
from gpca.settings import Keys, changes_of
from gpca.steps.shift import ShiftSettings

TABLE = "learners/"  # prefix of the set in the column `table` of the numbers
RHO = f"rho_max_score_{DISTANCES[0]}"
AREAS = {"aurc": diagnostics.aurc, "excess_aurc": diagnostics.excess_aurc, "augrc": diagnostics.augrc}

_SHIFT = changes_of(ShiftSettings, without=("beyond",)).kinds
# An encoder of another width would not fit beside the others.
Shift = Annotated[dict, Keys(_SHIFT | {"encoder": EncoderChanges, "severities": Severities}, required=_SHIFT)]


def check(config: dict, _left_out: LeftOut) -> None:
    shift, registrations = config["shift"], config["registrations"]
    encoder = config["encoders"][config["embedding"]["encoder"]] | shift["encoder"]
    require_draws("shift.encoder", encoder, registrations["cloud_points"], "registrations.cloud_points")
    for key, name in require_explained(config, "learners"):
        if explainer_entry(name).reads != "embeddings":
            raise InputError(f"config key {key}", "does not read embeddings", "choose another")
    entries = {"shift": shift, **{f"learners.{name}": entry or {} for name, entry in config["learners"].items()}}
    for key, entry in entries.items():
        if (neighbors := entry.get("neighbours", 0)) > registrations["train"]:
            fault = f"{neighbors} neighbors are too many for {registrations['train']} training samples"
            raise InputError(f"config key {key}.neighbours", fault, "lower it, or raise registrations.train")


def learner_titles(config: Mapping[str, Any]) -> dict[str, str]:
    return {name: explainer_entry(name).title.removesuffix(" on the embedding") for name in config["learners"]}


EXPERIMENT = Experiment(
    name="out_of_distribution",
    beside=("uncertainty_curves",),
    sections={"learners": ByName, "shift": Shift},
    names=lambda config, sources: {"learner": list(config["learners"])},
    check=check,
    optional_entries={"learners": Names("learner", explainers)},
)


SHIFT = Step(
    name="shift",
    run="gpca.steps.shift:shift",
    inputs={
        "objects": "objects/{source}.npz",
        "registrations": "registrations/{source}/seed{*seed}.npz",
        "embeddings": "embeddings/{source}/{embedding}/seed{*seed}.npz",
        "encoders": lambda plan, wildcards: (
            f"encoders/{wildcards.source}/{plan.config['embedding']['encoder']}/seed{{*seed}}.pt"
        ),
        # Of a source that the encoder never saw, the first other one.
        "other_registrations": lambda plan, wildcards: [
            f"registrations/{name}/seed{{*seed}}.npz" for name in plan.names["source"] if name != wildcards.source
        ][:1],
    },
    outputs={"out": "shifted/{source}/seed{*seed}.npz"},
    settings=lambda plan, wildcards: {
        "shift": plan.config["shift"],
        "registrations": plan.config["registrations"],
        "encoder": plan.encoder,
    },
    modules=lambda plan: [plan.encoder_module],
    target="shifted",
    priority=6,
)

FIT = Step(
    name="fit_learners",
    run="gpca.steps.shift:fit_learners",
    inputs={"sets": "shifted/{source}/seed{*seed}.npz"},
    outputs={"out": "learners/{source}/{*learner}/seed{*seed}.csv"},
    settings=lambda plan, wildcards: explainer_settings(plan.config, plan.config["learners"]),
    modules=lambda plan: map(explainer_module, plan.names["learner"]),
    target="learners",
    priority=4,
)


@numbers(
    "diagnostics.csv",
    "learner_intervals.csv",
    prediction_files="learners/{source}/{learner}/seed{seed}.csv",
    set_files="shifted/{source}/seed{seed}.npz",
)
def collect(run: Run, prediction_files: Paths, set_files: Paths) -> tuple[Frame, Frame]:
    """Diagnostics of every source, learner and set: by seed, and over all seeds with intervals over families.

    In the second frame, means are over samples; areas, calibration errors and correlations are those of each seed.
    """
    import pandas as pd

    by_seed, records = [], []
    answers: dict[tuple[str, str], list] = {}
    for (source, learner, seed), rows in predicted.read_learner_predictions(prediction_files, set_files).items():
        answers.setdefault((source, learner), []).append(rows.assign(seed=seed))
        for name, subset in predicted.sets_of(rows).items():
            values = correlations(subset) | ({} if "+" in name else probability_metrics(subset))
            by_seed += [(TABLE + name, source, learner, metric, ALL, seed, float(v)) for metric, v in values.items()]
    for (source, learner), parts in answers.items():
        for name, subset in predicted.sets_of(pd.concat(parts, ignore_index=True)).items():
            # A family is another cluster than that of the same name in the set of the other source.
            clusters = list(subset["cluster"].where(subset["set"] != "source", "other/" + subset["cluster"]))
            samples = Clustered.drawn(subset["seed"], clusters, "learner intervals", source, name)
            score_S, wrong_S = subset["max_score"].to_numpy(float), predicted.wrong(subset)
            correlation = partial(_of_rows, diagnostics.rank_correlation, score_S, subset[DISTANCES[0]].to_numpy(float))
            estimates = {RHO: samples.over_seeds(correlation, (-1, 1))}
            if "+" not in name:
                estimates |= predicted.estimates_of_scores(subset, samples)
                for area, function in AREAS.items():
                    measure = partial(_of_rows, function, -score_S, wrong_S)
                    estimates[f"{area}_max_score"] = samples.over_seeds(measure, (0, 1))
            keys = (TABLE + name, source, learner)
            records += [samples.record((*keys, metric, ALL), estimate) for metric, estimate in estimates.items()]
    return tidy(by_seed, "learners"), intervals(records, "learners")


def _of_rows(function, first_S: np.ndarray, second_S: np.ndarray, rows: np.ndarray, weights_B_n: np.ndarray):
    return function(first_S[rows], second_S[rows], weights_B_n)


def correlations(rows: Frame) -> dict[str, float]:
    return {
        f"rho_{score}_{distance}": diagnostics.rank_correlation(rows[score], rows[distance])
        for score in predicted.scores_of(rows)
        for distance in DISTANCES
    }


def probability_metrics(rows: Frame) -> dict[str, float]:
    """Accuracy, calibration errors, proper scores and the areas under risk and coverage of one set."""
    p_S_C, target_S = predicted.probabilities(rows)
    wrong_S = predicted.wrong(rows)
    values = {
        "accuracy": np.mean(~wrong_S),
        "confidence": p_S_C.max(axis=1).mean(),
        "ece": diagnostics.calibration_error(p_S_C, target_S),
        "nll": diagnostics.negative_log_likelihood(p_S_C, target_S),
        "brier": diagnostics.brier_score(p_S_C, target_S),
        "test_samples": len(rows),
    }
    areas = product(predicted.scores_of(rows), AREAS.items())
    return values | {f"{area}_{score}": of(-rows[score].to_numpy(), wrong_S) for score, (area, of) in areas}


SECTION = "IV-D Ablation studies"
INTERVALS = {"intervals": "learner_intervals.csv"}
PRINTED_SOURCE = "ycb"  # the paper prints ρ, AUC and ECE of it
SHIFTED = {"severity": "severities beyond", "source": "unseen source", "objects": "unseen objects"}
AREA_LOOK: dict[str, Any] = {"factor": 1, "decimals": 4, "limits": (0, 1), "least_is_best": True}
ERROR_LOOK: dict[str, Any] = {"factor": 1, "decimals": 3, "limits": (0, 1), "least_is_best": True}
RHO_LOOK: dict[str, Any] = {"factor": 1, "decimals": 3, "limits": (-1, 1)}
OF_DISTANCE = (
    "ρ: Spearman's correlation of 1 - largest score with the distance to the training samples, the mean over the "
    "nearest ones in the space of the analytical features; diagnostics.csv has the other scores and distances."
)
OF_SEEDS = "ρ, areas and ECE are those of each seed, mean."
AREA = "AURC: the area under the curve of risk over coverage, which is the mean risk; the paper's AUC."
CALIBRATION = "ECE: expected calibration error over 15 equally wide bins."


def _show(metric: str, title: str, name: str = "in_distribution", source: str = "", **look: Any) -> Show:
    return show(metric, title, where={"table": TABLE + name} | ({"source": source} if source else {}), **look)


@table(
    SECTION,
    "Table V: learners and the worth of their uncertainty",
    """Table V of the paper: accuracy of classifiers on the same embeddings, and what their uncertainty is worth: its
    correlation with the distance to the training samples, risk over coverage and calibration.""",
    paper=True,
    **INTERVALS,
)
def table5_learners(run: Run, intervals: Frame) -> Table:
    areas = {"aurc": "AURC", "excess_aurc": "E-AURC", "augrc": "AUGRC"}
    columns = {
        "accuracy": _show("accuracy", "Accuracy (%)"),
        "rho": _show(RHO, "ρ", **RHO_LOOK),
        **{area: _show(f"{area}_max_score", title, **AREA_LOOK) for area, title in areas.items()},
        "ece": _show("ece", "ECE (share)", **ERROR_LOOK),
        "nll": _show("nll", "NLL (nats)", **ERROR_LOOK | {"limits": (0, inf)}),
        "brier": _show("brier", "Brier", **ERROR_LOOK | {"limits": (0, 2)}),
    }
    notes = (
        OF_DISTANCE,
        f"{AREA} E-AURC: AURC minus the least possible with as many errors; AUGRC: mean share of undetected "
        f"failures. {CALIBRATION}",
    )
    caption = "Accuracy and uncertainty of learners on the same embeddings"
    return _by_source("table5_learners", run, intervals, columns, caption, notes)


@table(
    SECTION,
    "Table V in the paper's form",
    """Table V as the paper prints it: a row for each learner, its accuracy on each dataset, and ρ, AURC (the paper's
    AUC) and ECE on YCB.""",
    paper=True,
    **INTERVALS,
)
def table5_compact(run: Run, intervals: Frame) -> Table:
    one = PRINTED_SOURCE if PRINTED_SOURCE in run.sources else list(run.sources)[-1]
    columns = {source: _show("accuracy", f"{title} (%)", source=source) for source, title in run.source_titles.items()}
    columns["rho"] = _show(RHO, "ρ", source=one, **RHO_LOOK)
    columns["aurc"] = _show("aurc_max_score", "AURC", source=one, **AREA_LOOK)
    columns["ece"] = _show("ece", "ECE (share)", source=one, **ERROR_LOOK)
    rows = crossed(("method", learner_titles(run.config)))
    sheet = Sheet("table5_compact", {"learner": "Learner"}, rows, columns, intervals)
    shown = [source for source in run.sources if any(key == source for _, key in sheet.cells)]
    samples = span(samples_of_seed(intervals, source, "in_distribution") for source in shown)
    title = run.sources[one]["title"]
    caption = f"Accuracy of learners by dataset, and what their uncertainty is worth on {title}{run.stand_ins()}"
    notes = (f"{sheet.over(samples)}. {OF_SEEDS} Bold: best of a column.", OF_DISTANCE, f"{AREA} {CALIBRATION}")
    return sheet.table(caption, "quantity", notes, bold=columns)


@table(
    SECTION,
    "Table V under shift",
    """The same classifiers on samples unlike those of the training: stronger perturbations, another source's objects,
    and objects that neither encoder nor classifier saw.""",
    **INTERVALS,
)
def table5_shift(run: Run, intervals: Frame) -> Table:
    columns: dict[str, Show] = {}
    for name, title in SHIFTED.items():
        columns[f"accuracy_{name}"] = _show("accuracy", f"Acc., {title} (%)", name)
        columns[f"ece_{name}"] = _show("ece", f"ECE, {title} (share)", name, **ERROR_LOOK)
        columns[f"rho_{name}"] = _show(RHO, f"ρ, {title}", with_training_like(name), **RHO_LOOK)
    notes = (
        f"{OF_DISTANCE} It is taken over the shifted samples and those like the training's together.",
        f"Unseen objects: another encoder and other learners, which never saw some of the objects. {CALIBRATION}",
    )
    caption = "Learners on samples unlike those of the training"
    return _by_source("table5_shift", run, intervals, columns, caption, notes)


def _by_source(
    name: str, run: Run, intervals: Frame, columns: Mapping[str, Show], caption: str, notes: Iterable[str]
) -> Table:
    """A table of sources × learners; its first footnote counts the test samples of every set."""
    rows: list[Row] = crossed(("source", run.source_titles), ("method", learner_titles(run.config)))
    sheet = Sheet(name, {"source": "Dataset", "learner": "Learner"}, rows, columns, intervals)
    shown = [row.labels[0][0] for row in sheet.rows]
    there = set(rows_where(intervals, source=shown[0])["table"].str.removeprefix(TABLE))
    counts = [f"{samples_of_seed(intervals, shown[0], part)} {in_words(part)}" for part in TRAINED_ON if part in there]
    samples = f"Test samples of a seed (of the first dataset): {', '.join(counts)}. Bold: best of a dataset."
    first = f"{over_clusters(sheet.seeds)}. {OF_SEEDS} {samples}"
    return sheet.table(caption + run.stand_ins(shown), "quantity", (first, *notes), bold=columns, same=1)


def samples_of_seed(intervals: Frame, source: str, name: str) -> int:
    rows = rows_where(intervals, table=TABLE + name, source=source, metric="accuracy")
    return int((rows["samples"] // rows["seeds"]).max())
