"""Causes of failed registrations: explainers against the measured shares of each cause in the error (Table IX)."""

import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from gpca.attribution.metrics import ABSTAINED, PREDICTED_AS, confusion
from gpca.causes.dataset import LABELS
from gpca.causes.judged import CEILING, MEASURES, Judged, counted, joined, measure, read_judged
from gpca.causes.settings import DescriptorSettings
from gpca.causes.truth import BORDERLINE
from gpca.declarations import ByName, Experiment, Frame, LeftOut, Names, Paths, Plan, Run, Step, Wildcards, numbers
from gpca.encoders.registry import NamedEncoder, encoder_module, require_backbone, require_draws
from gpca.errors import InputError, with_key
from gpca.evaluation.intervals import ANYTHING, TRIVIAL, WITHOUT_TRAINING, Clustered
from gpca.evaluation.measures import ALL, POOLED, Measure, Rivals, compared, intervals, tidy
from gpca.explainers.interface import BARE, EMBEDDINGS, REENACTED, icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry, explainer_module, explainers, require_settings
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import part_of

NAME = "diagnosis"
TABLE = "causes"
TRAINED = "trained"  # kind of differences: from the best explainer that is trained and reads no re-enactment
JUDGED = "reenact"  # explainer whose lead over that is reported


@dataclass(frozen=True)
class Section:
    """The settings by which explainers of causes describe, re-enact, encode and explain a pair."""

    descriptors: Annotated[dict, part_of(DescriptorSettings)]
    reenactment: Annotated[dict, part_of(ReenactmentSettings)]
    encoder: NamedEncoder
    explainers: ByName
    by_features: ByName


def check(config: dict, _left_out: LeftOut) -> None:
    encoder = config[NAME]["encoder"]
    with_key("diagnosis.encoder.backbone", require_backbone, encoder["backbone"])
    require_draws("diagnosis.encoder", encoder, config["causes"]["points"][1], "causes.points")
    for key in ("explainers", "by_features"):
        for name, settings in config[NAME][key].items():
            with_key(f"diagnosis.{key}.{name}", require_settings, name, settings or {}, CAUSES)
    for name in config[NAME]["by_features"]:
        if explainer_entry(name, CAUSES).reads != "descriptors":
            fault = "reads no descriptors, by whose parts the explainers of this table differ"
            raise InputError(f"config key diagnosis.by_features.{name}", fault, "move it to diagnosis.explainers")


def cause_titles(config: Mapping[str, Any], key: str = "explainers") -> dict[str, str]:
    """Titles of the explainers of causes, or of those that differ in what they read."""
    return {name: explainer_entry(name, CAUSES).title for name in config[NAME][key]}


def cause_costs(
    config: Mapping[str, Any], names: Iterable[str], reenactment: Mapping[str, Any] | None = None
) -> dict[str, dict[str, Any]]:
    """What each explainer ``sees``, in words, and its number of ``icp_calls`` beyond the one that it explains."""
    starts, descriptors = config["causes"]["starts"], DescriptorSettings(**config[NAME]["descriptors"])
    reenacted = ReenactmentSettings(**(reenactment or config[NAME]["reenactment"])).calls(starts)
    entries = {name: explainer_entry(name, CAUSES) for name in names}
    calls = {name: icp_calls(entry.sees, starts, descriptors, reenacted) for name, entry in entries.items()}
    return {name: {"sees": entry.sight, "icp_calls": calls[name]} for name, entry in entries.items()}


EXPERIMENT = Experiment(
    name=NAME,
    beside=("cause_figures", "cause_tables", "sample_strata"),
    sections={NAME: Section},
    names=lambda config, sources: {
        "cause_explainer": list(config[NAME]["explainers"]),
        "feature_explainer": list(config[NAME]["by_features"]),
    },
    check=check,
    optional_entries={
        f"diagnosis.{key}": Names("explainer", lambda: explainers(CAUSES)) for key in ("explainers", "by_features")
    },
)


FOLDERS = {EMBEDDINGS: "cause_embeddings", REENACTED: "reenactments", BARE: "causes"}  # by what is read


def _folder_read(wildcards: Wildcards) -> str:
    return FOLDERS.get(explainer_entry(wildcards.cause_explainer, CAUSES).reads, "descriptors")


def _of_all(wildcards: Wildcards, folder: str) -> str | list[str]:
    """Files of all sources; none for an explainer of one source, or of embeddings by an encoder of one source."""
    entry = explainer_entry(wildcards.cause_explainer, CAUSES)
    return [] if entry.reads == EMBEDDINGS else f"{folder}/{{*source}}/seed{{*seed}}.npz"


def explaining_modules(plan: Plan, names: Iterable[str]) -> list[str]:
    """Modules of explainers of causes, and that of the encoder whose embeddings some of them read."""
    encoder = encoder_module(plan.config[NAME]["encoder"])
    return [encoder, *(explainer_module(name, CAUSES) for name in names)]


FURTHER = "learning_samples/{*source}/chunk{*chunk}.npz"
DIAGNOSE = Step(
    name="diagnose",
    run="gpca.steps.diagnosis:diagnose",
    inputs={
        "causes": "causes/{source}/seed{*seed}.npz",
        "read": lambda plan, wildcards: f"{_folder_read(wildcards)}/{{source}}/seed{{*seed}}.npz",
        "read_timings": lambda plan, wildcards: f"timings/{{source}}/{_folder_read(wildcards)}/seed{{*seed}}.csv",
        "all_causes": lambda plan, wildcards: _of_all(wildcards, "causes"),
        "all_read": lambda plan, wildcards: _of_all(wildcards, _folder_read(wildcards)),
        "further": lambda plan, wildcards: (
            FURTHER if explainer_entry(wildcards.cause_explainer, CAUSES).further else []
        ),
    },
    outputs={
        "predictions": "diagnoses/{source}/{cause_explainer}/seed{*seed}.csv",
        "timings": "timings/{source}/diagnoses_{cause_explainer}/seed{*seed}.csv",
    },
    settings=lambda plan, wildcards: plan.config[NAME]["explainers"][wildcards.cause_explainer] or {},
    params={
        "explainer": lambda plan, wildcards: wildcards.cause_explainer,
        "remedies": lambda plan, wildcards: json.dumps(plan.config[NAME]["descriptors"], sort_keys=True),
        "reenactment": lambda plan, wildcards: json.dumps(plan.config[NAME]["reenactment"], sort_keys=True),
    },
    modules_of_job=lambda plan, wildcards: [explainer_module(wildcards.cause_explainer, CAUSES)],
    target="diagnoses",
)
DIAGNOSE_BY_FEATURES = Step(
    name="diagnose_by_features",
    run="gpca.steps.diagnosis:diagnose_by_features",
    inputs={
        "causes": "causes/{source}/seed{*seed}.npz",
        "descriptors": "descriptors/{source}/seed{*seed}.npz",
        "all_causes": "causes/{*source}/seed{*seed}.npz",
        "all_read": "descriptors/{*source}/seed{*seed}.npz",
    },
    outputs={"predictions": "feature_diagnoses/{source}/{*feature_explainer}/seed{*seed}.csv"},
    settings=("diagnosis.by_features", "diagnosis.descriptors"),
    modules=lambda plan: [explainer_module(name, CAUSES) for name in plan.names["feature_explainer"]],
)
CAUSES_FILES = "causes/{source}/seed{seed}.npz"
DIAGNOSES = "diagnoses/{source}/{cause_explainer}/seed{seed}.csv"


@numbers(
    "causes.csv", "cause_intervals.csv", rule="cause_metrics", prediction_files=DIAGNOSES, causes_files=CAUSES_FILES
)
def collect(run: Run, prediction_files: Paths, causes_files: Paths) -> tuple[Frame, Frame]:
    """Confusions of all but borderline test samples and measures by seed; the measures of all seeds, with intervals."""
    judged, records = with_pooled(read_judged(prediction_files, causes_files)), []
    for (source, explainer, seed), samples in judged.items():
        values = {metric: value_1[0] for metric, value_1 in measure(samples, np.ones((1, len(samples)))).items()}
        rows = [(metric, ALL, value) for metric, value in values.items() if np.isfinite(value)]
        rows.append(("test_samples", ALL, len(samples)))
        if samples.names_causes:
            labeled = samples.subset(samples.label != BORDERLINE)
            counts_4_5 = confusion(labeled.label, labeled.named, labeled.named == "", LABELS)
            for true, counts_5 in zip(LABELS, counts_4_5, strict=True):
                predicted = zip((*LABELS, ABSTAINED), counts_5, strict=True)
                rows += [(PREDICTED_AS + label, true, count) for label, count in predicted if counts_5.sum()]
        records += [(TABLE, source, explainer, metric, part, seed, float(value)) for metric, part, value in rows]
    against = AGAINST | {TRAINED: trained_rivals}
    return tidy(records, "diagnoses"), compared_by_source(by_source(judged), against=against)


@numbers(
    "feature_intervals.csv",
    prediction_files="feature_diagnoses/{source}/{feature_explainer}/seed{seed}.csv",
    causes_files=CAUSES_FILES,
)
def collect_by_features(run: Run, prediction_files: Paths, causes_files: Paths) -> Frame:
    """Measures over all seeds with intervals, of learners that differ in what they read."""
    return compared_by_source(by_source(with_pooled(read_judged(prediction_files, causes_files))))


def with_pooled(judged: dict[tuple[str, str, int], Judged]) -> dict[tuple[str, str, int], Judged]:
    """Samples by source, explainer and seed, and those of all sources together where there are several."""
    sources, pooled = dict.fromkeys(source for source, _, _ in judged), {}
    for explainer, seed in dict.fromkeys(key[1:] for key in judged) if len(sources) > 1 else ():
        parts = [judged[source, explainer, seed] for source in sources if (source, explainer, seed) in judged]
        if len(parts) == len(sources):
            pooled[POOLED, explainer, seed] = joined(parts)
    return judged | pooled


def by_source(judged: Mapping[tuple[str, str, int], Judged]) -> dict[str, dict[str, Judged]]:
    found: dict[str, dict[str, Judged]] = {}
    for source, explainer in dict.fromkeys(key[:2] for key in judged):
        seeds = [samples for key, samples in judged.items() if key[:2] == (source, explainer)]
        found.setdefault(source, {})[explainer] = joined(seeds)
    return found


# The ceiling is no rival, and none of it.
AGAINST: dict[str, Rivals] = {
    "rival": lambda name, names: () if name == CEILING else [other for other in names if other != CEILING],
    "trivial": lambda name, names: () if name == CEILING else TRIVIAL,
}


def trained_rivals(name: str, names: Collection[str]) -> list[str]:
    """Rivals of what needs no training, and of all but the ceiling: who learns and reads no re-enactment."""
    entries = explainers(CAUSES)
    learned = [other for other in names if other in entries and other not in WITHOUT_TRAINING]
    return [other for other in learned if name != CEILING and "reenactment" not in entries[other].sees]


def compared_by_source(
    samples_of: Mapping[str, Mapping[str, Judged]], against: Mapping[str, Rivals] = AGAINST
) -> Frame:
    """Measures of every source and explainer with intervals over objects and seeds, and differences from rivals."""
    records: list[tuple] = []
    for source, by_explainer in samples_of.items():
        samples = next(iter(by_explainer.values()))
        draws = Clustered.drawn(samples.seed, samples.instance, "cause intervals", source)
        records += compared_samples(source, by_explainer, draws, measure, MEASURES, against=against)
    return intervals(records, "diagnoses")


def compared_samples(
    source: str,
    samples_of: Mapping[str, Judged],
    draws: Clustered,
    measured: Callable[[Judged, np.ndarray], dict[str, np.ndarray]],
    metrics: Iterable[str],
    part: str = ALL,
    against: Mapping[str, Rivals] = AGAINST,
) -> list[tuple]:
    """Rows of :func:`gpca.evaluation.measures.compared` for explainers of the same samples.

    `measured` returns the measures of samples by weights; the ``samples`` of a row are those that its measure counts.
    """
    samples = next(iter(samples_of.values()))
    values = {explainer: measured(each, draws.weights) for explainer, each in samples_of.items()}
    rows: list[tuple] = []
    for metric in metrics:
        of_metric = {explainer: each[metric] for explainer, each in values.items() if metric in each}
        how, subset = MEASURES.get(metric, Measure(limits=ANYTHING)), draws.subset(counted(samples, metric))
        rows += compared(
            (TABLE, source), metric, part, of_metric, subset, how.limits, against, least_is_best=how.least_is_best
        )
    return rows
