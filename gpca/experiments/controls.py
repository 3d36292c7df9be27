"""Explanations with a shortcut closed: clouds of one density, unseen objects, wrong labels and others (Table X)."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.judged import ranking
from gpca.causes.settings import NOT_OF_CAUSES, CauseSettings
from gpca.declarations import EXPLAINERS, ByName, Experiment, Frame, LeftOut, Paths, Plan, Run, Step, Wildcards, numbers
from gpca.errors import InputError, with_key
from gpca.evaluation.intervals import TRIVIAL, Clustered, best_of, interval, weighted_mean
from gpca.evaluation.measures import ALL, POOLED, TEST_SAMPLES, intervals, source_method_seed, tidy
from gpca.experiments.explained import explainer_settings, require_explained
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import explainer_entry, explainer_module
from gpca.io.csv_file import numbers as number_column
from gpca.settings import changes_of
from gpca.steps import control_samples as samples
from gpca.steps.control_samples import HARD, PAPER, RETRAINED, TRANSFER

CALLS, AUROC = "icp_calls", "auroc_error"
SECTION = "Beyond the paper: what explainers look at, and whether it carries over"
USUAL, RIVAL, OF_TRIVIAL = "usual", "rival", "trivial"  # kinds of differences, the column `against`


@dataclass(frozen=True, kw_only=True)
class Section(samples.ControlSettings):
    """The controls, and the explainers under them, with settings beyond those that they have elsewhere."""

    explainers: ByName
    hard: Annotated[dict, changes_of(CauseSettings, without=NOT_OF_CAUSES)]  # from how the causes are drawn


def check(config: dict, _left_out: LeftOut) -> None:
    hard = config["causes"] | config["controls"]["hard"]
    with_key("controls.hard", CauseSettings.from_dict, hard, config["registrations"]["icp"])
    for key, name in require_explained(config, "controls.explainers"):
        entry = explainer_entry(name)
        if entry.design and not entry.observed_only:
            fault = "needs more Monte-Carlo ICP than that of the observed pair, which is all that a control runs"
            raise InputError(f"config key {key}", fault, "leave it out")


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """One source alone admits no transfer."""
    controls = config["controls"]
    return {
        "control_seed": list(config["seeds"])[: controls["seeds"]],
        "control": list(RETRAINED),
        "hard_source": list(controls["hard_sources"]),
        "control_embedding": config["embedding"]["encoder"],
        "transfer_source": list(sources) if TRANSFER in controls["controls"] and len(sources) > 1 else [],
    }


EXPERIMENT = Experiment(
    name="controls",
    beside=("control_tables",),
    sections={"controls": Section},
    names=names,
    check=check,
    optional_entries={"controls.explainers": EXPLAINERS},
    lists={"controls.hard_sources": "sources"},
)


def _controls_of(plan: Plan, wildcards: Wildcards) -> tuple[list[str], list[str]]:
    """Controls of a seed, and those for which it has encoders of its own, which only the first seeds train."""
    own = wildcards.source in plan.names["hard_source"]
    chosen = [name for name in plan.config["controls"]["controls"] if own or name != HARD]
    if int(wildcards.seed) not in plan.names["control_seed"][: plan.config["controls"]["encoder_seeds"]]:
        chosen = [name for name in chosen if name in samples.OF_EVERY_SEED or name not in RETRAINED]
    return chosen, [name for name in chosen if name in RETRAINED]


def _of_all_hard(plan: Plan, wildcards: Wildcards, file: str, read: str = "") -> list[str]:
    """Hard files of all sources, where the job has hard samples and, if given, an explainer that reads such files."""
    reads = ["", *(explainer_entry(name).reads for name in plan.config["controls"]["explainers"])]
    is_asked = HARD in _controls_of(plan, wildcards)[0] and read in reads
    return [file.replace("{source}", "{*hard_source}")] if is_asked else []


def _other_sources(plan: Plan, wildcards: Wildcards) -> list[str]:
    return [name for name in plan.names["transfer_source"] if name != wildcards.source]


def _causes(plan: Plan) -> dict[str, Any]:
    return plan.config["causes"] | plan.config["controls"]["hard"]


def _settings(plan: Plan, wildcards: Wildcards) -> dict[str, Any]:
    controls = {key: value for key, value in plan.config["controls"].items() if key not in ("explainers", "hard")}
    return {"controls": controls | {"controls": _controls_of(plan, wildcards)[0]}, "encoder": plan.encoder}


HARD_REENACTED = f"{samples.HARD_REENACTMENTS}/{{source}}/seed{{seed}}.npz"
HARD_FILE, SEED_FILE = "hard/{source}/seed{seed}.npz", "registrations/{source}/seed{seed}.npz"
SAMPLE = Step(
    name="sample_hard",
    run="gpca.steps.causes:causes",
    inputs={"objects": "objects/{source}.npz"},
    outputs={
        "causes": HARD_FILE,
        "candidates": "hard/{source}/seed{seed}.csv",
        "timings": "timings/{source}/hard/seed{seed}.csv",
    },
    settings=lambda plan, wildcards: _causes(plan) | {"icp": plan.config["registrations"]["icp"]},
)
REENACT = Step(
    name="reenact_hard",
    run="gpca.steps.causes:reenact",
    inputs={"causes": HARD_FILE, "causes_timings": "timings/{source}/hard/seed{seed}.csv"},
    outputs={"reenactments": HARD_REENACTED, "timings": "timings/{source}/hard_reenactments/seed{seed}.csv"},
    settings=lambda plan, wildcards: {
        "reenactment": plan.config["diagnosis"]["reenactment"],
        "causes": _causes(plan),
        "icp": plan.config["registrations"]["icp"],
    },
)
TRAIN = Step(
    name="train_control",
    run="gpca.steps.control_samples:train",
    inputs={"registrations": lambda plan, wildcards: [HARD_FILE if wildcards.control == HARD else SEED_FILE]},
    outputs={
        "embeddings": "control_embeddings/{control}/{source}/seed{seed}.npz",
        "curve": "control_embeddings/{control}/{source}/seed{seed}.csv",
    },
    settings=_settings,
    modules=lambda plan: [plan.encoder_module],
    priority=10,
)
EXPLAIN = Step(
    name="explain_controls",
    run="gpca.steps.controls:explain",
    inputs={
        "registrations": SEED_FILE,
        "other_registrations": lambda plan, wildcards: [
            f"registrations/{name}/seed{{seed}}.npz" for name in _other_sources(plan, wildcards)
        ],
        "all_hard": lambda plan, wildcards: _of_all_hard(plan, wildcards, HARD_FILE),
        "all_hard_reenactments": lambda plan, wildcards: _of_all_hard(plan, wildcards, HARD_REENACTED, REENACTED),
        "encoder": "encoders/{source}/{control_embedding}/seed{seed}.pt",
        "embeddings": "embeddings/{source}/{control_embedding}/none/seed{seed}.npz",
        "retrained_embeddings": lambda plan, wildcards: [
            f"control_embeddings/{name}/{{source}}/seed{{seed}}.npz" for name in _controls_of(plan, wildcards)[1]
        ],
    },
    outputs={"predictions": "controls/{source}/seed{seed}.csv"},
    settings=lambda plan, wildcards: (
        _settings(plan, wildcards)
        | {
            "explainers": explainer_settings(plan.config, plan.config["controls"]["explainers"]),
            "uncertainty": plan.config["uncertainty"].get("removal", {}),
            "icp": plan.config["registrations"]["icp"],
        }
    ),
    params={"retrained": lambda plan, wildcards: _controls_of(plan, wildcards)[1], "others": _other_sources},
    modules=lambda plan: [plan.encoder_module, *map(explainer_module, plan.config["controls"]["explainers"])],
    where={"seed": "control_seed"},
    target="controls",
    priority=5,
)


def read_controls(files: Paths) -> Frame:
    """Predictions of files named ``…/{source trained on}/seed{seed}.csv``; `source` is the one that is tested.

    ``cluster`` names the family with its source. An abstained sample is not ``right``.
    """
    import pandas as pd

    frames = []
    for path in files:
        _, trained_on, seed = source_method_seed(path)
        rows = read_predictions(path, samples.LABELS)
        frames.append(
            rows[["control", "explainer", CALLS]].assign(
                source=rows["tested"],
                trained_on=trained_on,
                seed=seed,
                cluster=rows["tested"] + "/" + rows["cluster"],
                right=(rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"],
                entropy=number_column(path, rows, "entropy"),
            )
        )
    if not frames:
        raise InputError("controls", "no files were given", "name at least one explainer in controls.explainers")
    return pd.concat(frames, ignore_index=True)


def auroc_error(rows: Frame, weights_B_N: np.ndarray) -> np.ndarray:
    """Area (B,) under the ROC curve by which the entropy separates wrong from right; NaN where it cannot."""
    return ranking(rows["entropy"].to_numpy(), ~rows["right"].to_numpy(), weights_B_N)["area"]


@numbers("controls.csv", rule="control_metrics", files="controls/{source}/seed{control_seed}.csv")
def collect(run: Run, files: Paths) -> Frame:
    """Accuracy, and AUROC of errors by entropy, by seed; the ``concept`` of transfer is the source trained on."""
    records: list[tuple] = []
    keys = ["control", "source", "trained_on", "explainer", "seed"]
    for (control, source, trained_on, explainer, seed), rows in read_controls(files).groupby(keys, sort=False):
        concept = trained_on if control == TRANSFER else ALL
        values = {"accuracy": rows["right"].mean(), TEST_SAMPLES: len(rows)}
        values[AUROC] = auroc_error(rows, np.ones((1, len(rows))))[0]
        finite = [(metric, float(value)) for metric, value in values.items() if np.isfinite(value)]
        records += [(control, source, explainer, metric, concept, seed, value) for metric, value in finite]
    return tidy(records, "controls")


Values = dict[str, np.ndarray]  # metric -> values (1 + B,)


@numbers("control_intervals.csv", files="controls/{source}/seed{control_seed}.csv")
def collect_intervals(run: Run, files: Paths) -> Frame:
    """Accuracy and AUROC of every control and explainer over all seeds, with differences, by source and over all.

    Of transfer there is a row for each source trained on, and one for all others together. Differences against
    ``usual`` are from the paper's protocol on the same seeds and sources, which also has the ICP calls.
    """
    predictions = read_controls(files)
    sources = list(dict.fromkeys(predictions["source"]))
    records: list[tuple] = []
    for source in (*sources, POOLED) if len(sources) > 1 else sources:
        subset = predictions if source == POOLED else predictions[predictions["source"] == source]
        measured: dict[tuple[str, str], dict[str, tuple[Values, Clustered, Values]]] = {}
        for explainer, rows in subset.groupby("explainer", sort=False):
            draws = Clustered.drawn(rows["seed"], rows["cluster"], "control intervals", source)
            masks: dict[tuple[str, str], np.ndarray] = {}  # control, and `all` or the source trained on -> (N,)
            for control in rows["control"].unique():
                mask_N = (rows["control"] == control).to_numpy()
                for other in rows["trained_on"][mask_N].unique() if control == TRANSFER and source != POOLED else ():
                    masks[control, other] = mask_N & (rows["trained_on"] == other).to_numpy()
                masks[control, POOLED if control == TRANSFER else ALL] = mask_N
            for key, mask_N in masks.items():
                same = (rows["control"] == PAPER) & rows["seed"].isin(rows["seed"][mask_N])
                same &= rows["source"].isin(rows["source"][mask_N])
                usual_values, own = _values(rows[same], draws.subset(same.to_numpy())), draws.subset(mask_N)
                measured.setdefault(key, {})[str(explainer)] = _values(rows[mask_N], own), own, usual_values
        for explainer in subset["explainer"].unique():
            for (control, trained_on), group in measured.items():
                if explainer in group:
                    records += _records((control, source), trained_on, explainer, group)
    return intervals(records, "controls", most=1.0)


def _values(rows: Frame, draws: Clustered) -> Values:
    values = {"accuracy": weighted_mean(rows["right"], draws.weights), AUROC: auroc_error(rows, draws.weights)}
    if (rows["control"] == PAPER).all():
        values[CALLS] = np.full(len(draws.weights), rows[CALLS].mean())
    return values


def _records(keys: tuple[str, str], trained_on: str, explainer: str, group: Mapping) -> Iterable[tuple]:
    """Rows of an explainer: each measure, and its differences."""
    values, draws, usual_values = group[explainer]
    accuracies = {name: measured["accuracy"] for name, (measured, *_) in group.items()}
    rivals = sorted(name for name in accuracies if name != explainer)
    for metric, value_B in values.items():
        if not np.isfinite(value_B[0]):
            continue
        row = (*keys, explainer, metric, trained_on)
        drawn_B_N = None if metric == CALLS else draws.weights[1:]
        yield draws.record((*row, "", ""), interval(value_B, drawn_B_N))
        others = {USUAL: (PAPER, usual_values[metric])} if keys[0] != PAPER and metric in usual_values else {}
        if metric == "accuracy":
            for kind, candidates in ((RIVAL, rivals), (OF_TRIVIAL, [name for name in TRIVIAL if name in rivals])):
                if other := best_of(accuracies, candidates):
                    others[kind] = other, accuracies[other]
        for kind, (other, other_B) in others.items():
            if np.isfinite(value_B[0] - other_B[0]):
                yield draws.record((*row, kind, other), interval(value_B - other_B, drawn_B_N, difference=True))
