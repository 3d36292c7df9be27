"""Causes of failed registrations of scans to scans, and which explainers name them (Table XVIII)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from gpca.alignment.methods.registry import method_module
from gpca.attribution.predictions import read_predictions
from gpca.causes import judged as answers
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.scans import GLOBAL, KINDS
from gpca.causes.settings import SCANS, ScanSamples
from gpca.causes.truth import BORDERLINE, GEOMETRY
from gpca.declarations import Experiment, Frame, LeftOut, Names, Paths, Run, Step, numbers
from gpca.errors import InputError, with_key
from gpca.evaluation.intervals import TRIVIAL, Clustered, best_of, corrected, interval, weighted_mean
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.diagnosis import explaining_modules
from gpca.experiments.frame_causes import count_ends, ends_of
from gpca.experiments.scans import EACH_SET, ChoiceSettings, files_of_set, place_of_set
from gpca.explainers.registry import CAUSES as CAUSE_EXPLAINERS
from gpca.explainers.registry import explainers, require_settings
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, read_csv, read_numbers
from gpca.io.csv_file import numbers as number_column
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.settings import ReenactmentSettings
from gpca.scans.scene import stratum_of
from gpca.seeds import seed_of_file
from gpca.settings import Distinct, changes_of, fields_of
from gpca.steps.scans import TrialSettings

Learned = Distinct[Literal["objects", "scans"]]


@dataclass(frozen=True, kw_only=True)
class Section(ScanSamples):
    """Which registrations are measured, and which explainers are asked.

    Attributes:
        reenactment: ``diagnosis.reenactment`` with these changes.
        explainers: name -> where it has learned; its settings are those of ``diagnosis.explainers``.
    """

    reenactment: Annotated[dict, changes_of(ReenactmentSettings)] = field(default_factory=dict)
    explainers: Annotated[dict[str, Learned], Field(min_length=1)]


def check(config: dict, _left_out: LeftOut) -> None:
    for name, settings in settings_of_explainers(config).items():
        with_key(f"scan_causes.explainers.{name}", require_settings, name, settings, CAUSE_EXPLAINERS)


def settings_of_explainers(config: Mapping[str, Any]) -> dict[str, dict]:
    settings = config["diagnosis"]["explainers"]
    return {name: settings.get(name) or {} for name in config["scan_causes"]["explainers"]}


def reenactment_settings(config: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of re-enactments of scans: those of objects, with changes."""
    return config["diagnosis"]["reenactment"] | (config["scan_causes"].get("reenactment") or {})


def measurement_settings(config: Mapping[str, Any], scan_set: str) -> dict[str, Any]:
    scans, first = config["scans"], config["scans"]["global_start"]
    return {
        "samples": fields_of(config["scan_causes"], ScanSamples),
        "entry": scans["datasets"][scan_set],
        "role": config["splits"]["role"],
        "scans": fields_of(scans, ChoiceSettings, TrialSettings) | {"success": scans["success"]},
        "methods": {first: scans["methods"].get(first) or config["methods"].get(first)},
        "causes": config["causes"],
        "descriptors": config["diagnosis"]["descriptors"],
        "reenactment": reenactment_settings(config),
    }


def diagnosis_settings(
    config: Mapping[str, Any], explainers: Mapping[str, Sequence[str]], settings: Mapping[str, Mapping]
) -> dict[str, Any]:
    """Settings of the step that explains scans: where each explainer learns, and the settings of each."""
    return {
        "samples": fields_of(config["scan_causes"], ScanSamples),
        "explainers": explainers,
        "settings": settings,
        "causes": {"starts": config["causes"]["starts"]},
        "descriptors": config["diagnosis"]["descriptors"],
        "reenactment": reenactment_settings(config),
        "encoder": config["diagnosis"]["encoder"],
    }


EXPERIMENT = Experiment(
    name="scan_causes",
    beside=("scan_failures",),
    sections={"scan_causes": Section},
    needs=("scan_set",),
    names=lambda config, _sources: {"scan_explainer": list(config["scan_causes"]["explainers"])},
    check=check,
    optional_entries={"scan_causes.explainers": Names("explainer", lambda: explainers(CAUSE_EXPLAINERS))},
)

MEASURE = Step(
    name="measure_scan_causes",
    run="gpca.steps.scan_causes:measure",
    data=files_of_set,
    outputs={
        "scan_causes": "scan_causes/{source}/seed{seed}.npz",
        "samples": "scan_causes/{source}/seed{seed}.csv",
        "descriptors": "scan_descriptors/{source}/seed{seed}.npz",
        "reenactments": "scan_reenactments/{source}/seed{seed}.npz",
    },
    settings=lambda plan, wildcards: measurement_settings(plan.config, wildcards.source),
    params={"place": place_of_set},
    modules=lambda plan: [method_module(plan.config["scans"]["global_start"])],
    where=EACH_SET,
    target="scan_causes",
    priority=10,
)


DIAGNOSE = Step(
    name="diagnose_scans",
    run="gpca.steps.scan_causes:diagnose",
    inputs={
        "scan_causes": "scan_causes/{*scan_set}/seed{seed}.npz",
        "scan_descriptors": "scan_descriptors/{*scan_set}/seed{seed}.npz",
        "scan_reenactments": "scan_reenactments/{*scan_set}/seed{seed}.npz",
        "causes": "causes/{*source}/seed{seed}.npz",
        "descriptors": "descriptors/{*source}/seed{seed}.npz",
        "reenactments": "reenactments/{*source}/seed{seed}.npz",
        "encoders": "cause_encoders/{*source}/seed{seed}.pt",
        "embeddings": "cause_embeddings/{*source}/seed{seed}.npz",
    },
    outputs={"predictions": "scan_diagnoses/seed{seed}.csv"},
    settings=lambda plan, _wildcards: diagnosis_settings(
        plan.config, plan.config["scan_causes"]["explainers"], settings_of_explainers(plan.config)
    ),
    params={"source": "scans"},
    modules=lambda plan: explaining_modules(plan, plan.config["scan_causes"]["explainers"]),
    where={"seed": "scan_seed"},
)

SHARES = {  # of the failed by each cause -> where it stands, and whether a pair counts as often as it stands for
    "share": ("end", False),
    "share_weighted": ("end", True),
    "share_one_sided": ("dominant_one_sided", True),
}
SAMPLE_COLUMNS = ("sample", "cluster", "overlap", "start", "times", "missed", "stands_for", "dominant_one_sided")
COLUMNS = (
    *("source", "condition", "stratum", "learned", "method", "metric", "samples", "clusters", "seeds"),
    *("value", "low", "high", "gate", "difference", "difference_low", "difference_high"),
)
NUMBERS = tuple(name for name in COLUMNS[6:] if name != "gate")
TRUTH = "truth"  # instead of an explainer, in rows of counts, ``count_<kind>``
FAILED = "failed"  # in rows of shares, ``share_<cause>``, of the failed whose start a global method found
EVERY = "all"  # strata
NATURAL, ADDED = "natural", "noise_added"  # conditions of what is measured; counts are of kinds of start as well
COUNTED = ("registrations", "pairs", "clusters", *LABELS, BORDERLINE, GEOMETRY, "missed")
GATE = "gate_"  # how the names of gates begin
NO_LEAD = ("", np.nan, np.nan, np.nan)
CAUSES = "cause_accuracy"
SAMPLES = "test_samples"  # that are nominal or failed; also where nothing else can be measured
MEASURED = (SAMPLES, "auroc_failed", "false_alarm_rate", "state_accuracy", CAUSES, "regret")
FEWEST_OF_A_CAUSE = 5  # failures, or the cause counts in no mean over causes


@numbers(
    "scan_causes.csv",
    rule="scan_cause_metrics",
    causes_files="scan_causes/{scan_set}/seed{scan_seed}.npz",
    sample_files="scan_causes/{scan_set}/seed{scan_seed}.csv",
    prediction_files="scan_diagnoses/seed{scan_seed}.csv",
)
def collect(run: Run, causes_files: Paths, sample_files: Paths, prediction_files: Paths) -> Frame:
    """Measures with intervals over clusters of scenes and seeds, and counts.

    Sources are data sets of scans, and all of them together. Conditions are natural registrations of all starts or of
    a kind, and those with noise added. ``difference`` is the paired difference from the best gate or trivial row.
    """
    import pandas as pd

    overlaps = list(run.config["scans"]["strata"])
    seen, judged = _read(causes_files, sample_files, prediction_files)
    seen["stratum"] = [stratum_of(overlap, overlaps) or "" for overlap in seen["overlap"]]
    times, start, sources = seen["times"].to_numpy(), seen["start"].to_numpy(), list(dict.fromkeys(seen["scans"]))
    conditions = {NATURAL: times <= 0, ADDED: times > 0}
    conditions |= {f"{NATURAL}_{kind}": (times <= 0) & (start == kind) for kind in KINDS}
    conditions |= {f"{ADDED}_{each:g}": times == each for each in sorted(set(times)) if each}
    rows: list[tuple] = []
    for source, (condition, rows_N) in product([POOLED, *sources] if len(sources) > 1 else sources, conditions.items()):
        mask_N = rows_N & ((seen["scans"] == source).to_numpy() | (source == POOLED))
        for stratum in (EVERY, *sorted(set(seen["stratum"]))):
            chosen = seen[mask_N & ((seen["stratum"] == stratum).to_numpy() | (stratum == EVERY))]
            if len(chosen):
                counts = count_ends(chosen, ("pair", "cluster"), "registrations")
                place = source, condition, stratum, SCANS, TRUTH
                sizes = (len(chosen), counts["clusters"], chosen["seed"].nunique())
                nothing = (np.nan, np.nan, *NO_LEAD)
                rows += [(*place, f"count_{kind}", *sizes, float(counts[kind]), *nothing) for kind in COUNTED]
        if condition == f"{NATURAL}_{GLOBAL}" and source != POOLED:
            rows += _shares((source, condition, EVERY, SCANS, FAILED), seen[mask_N & seen["end"].isin(CONCEPTS)])
        if condition in (NATURAL, ADDED) and mask_N.any():
            parts = {key: every.subset(mask_N) for key, every in judged.items()}
            rows += _measures((source, condition, EVERY), parts, seen["cluster"][mask_N].to_numpy(str))
    collected = pd.DataFrame(rows, columns=list(COLUMNS))
    bounds = ["difference_low", "difference_high"]
    for _, of in collected.groupby(["source", "condition", "stratum", "metric"]):
        reach, led = of["high"].max() - of["low"].min(), of[of["gate"] != ""]
        value_M, low_M, high_M, clusters_M = led[["difference", *bounds, "clusters"]].to_numpy(float).T
        widened = corrected(value_M, low_M, high_M, clusters_M, reach=np.inf if np.isnan(reach) else reach)
        collected.loc[led.index, bounds] = np.column_stack(widened)
    return collected


def _shares(place: tuple, failed: Frame) -> Iterator[tuple]:
    """Shares of the failed by each cause: as drawn, and as the overlaps of the data set are."""
    draws = Clustered.drawn(failed["seed"], failed["cluster"], "scan shares", *place)
    for (name, (column, weighted)), concept in product(SHARES.items(), CONCEPTS):
        weight_N = failed["stands_for"].to_numpy() if weighted else 1.0
        share_B = weighted_mean(failed[column] == concept, draws.weights * weight_N)
        yield (*place, f"{name}_{concept}", *draws.counts[::-1], *interval(share_B, draws.weights[1:]), *NO_LEAD)


def read_scan_causes(path: str | Path) -> Frame:
    """Read what :func:`collect` returned; a value may lack an interval, and a difference from the trivial ones."""
    return read_numbers(path, COLUMNS, NUMBERS, optional=NUMBERS[4:]).assign(concept=ALL)


def _read(causes_files, sample_files, prediction_files) -> tuple[Frame, dict[tuple[str, str], answers.Judged]]:
    """A row for each registration, and the answers of each explainer, by where it learned and its name."""
    import pandas as pd

    labels = "scans", "learned", "explainer"
    predicted = {seed_of_file(path): read_predictions(path, labels=labels) for path in prediction_files}
    seen: list[Frame] = []
    judged: dict[tuple[str, str], list[answers.Judged]] = {}
    for causes_file, sample_file in zip(causes_files, sample_files, strict=True):
        source, seed = Path(causes_file).parent.name, seed_of_file(causes_file)
        causes = Causes.load(causes_file, (source, seed))
        same = causes.registrations.arrays, "causes or the predictions", ("sample",)
        samples = read_csv(sample_file, SAMPLE_COLUMNS, others=ANY)[[*SAMPLE_COLUMNS]]
        require_same_samples(sample_file, samples, *same)
        for key, rows in predicted[seed].groupby(["learned", "explainer"], sort=False) if seed in predicted else ():
            rows = rows[rows["scans"] == source]
            require_same_samples(causes_file, rows, *same)
            judged.setdefault(key, []).append(answers.judged_by(rows, causes, seed))
        judged.setdefault(("", answers.CEILING), []).append(answers.ceiling_of(causes, seed))
        read = {name: number_column(sample_file, samples, name) for name in ("overlap", "times", "stands_for")}
        pair = [f"{source} {name}" for name in causes.registrations.object_name]
        seen.append(samples.assign(**read, scans=source, seed=seed, end=ends_of(causes.truth), pair=pair))
    if not seen:
        raise InputError("causes of scans", "no files were given", "name a data set of scans in the config")
    if short := [key for key, parts in judged.items() if len(parts) != len(seen)]:
        fault = f"explainer '{short[0][1]}' has no predictions of some data set or seed"
        raise InputError("predictions of scans", fault, "regenerate them")
    return pd.concat(seen, ignore_index=True), {key: answers.joined(parts) for key, parts in judged.items()}


def _measures(
    place: tuple[str, str, str], judged: dict[tuple[str, str], answers.Judged], cluster_N: np.ndarray
) -> Iterator[tuple]:
    any_samples = next(iter(judged.values()))
    draws = Clustered.drawn(any_samples.seed, cluster_N, "scan cause intervals", *place)
    values = {key: scan_measures(samples, draws.weights) for key, samples in judged.items()}
    names = {key: "/".join(key).strip("/") for key in judged}
    for metric in MEASURED:
        drawn = {key: each[metric] for key, each in values.items() if metric in each and np.isfinite(each[metric][0])}
        counted = draws.subset(counted_of_scans(any_samples, metric))
        drawn_B_n = counted.weights[1:] if metric in (*answers.SHARES, CAUSES) else None
        by_name = {names[key]: value_B for key, value_B in drawn.items()}
        for key, value_B in drawn.items():
            gates, lead = [names[other] for other in drawn if other != key and is_trivial(other[1])], NO_LEAD
            gate = best_of(by_name, gates, metric in answers.SMALLER_IS_BETTER)
            if gate and key[1] != answers.CEILING and metric != SAMPLES:
                lead = (gate, *interval(value_B - by_name[gate], drawn_B_n, difference=True))
            yield (*place, *key, metric, *counted.counts[::-1], *interval(value_B, drawn_B_n), *lead)


def is_trivial(explainer: str) -> bool:
    """Whether an explainer of scans is a gate or one of `TRIVIAL`."""
    return explainer.startswith(GATE) or explainer in TRIVIAL


def scan_measures(samples: answers.Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Measures (B,) of a diagnosis, with those of scans alone, by weights of the samples (B, N)."""
    measures = answers.measure(samples, weights_B_N)
    measures[SAMPLES] = np.full(len(weights_B_N), float((samples.label != BORDERLINE).sum()))
    if samples.names_causes:  # mean over the causes with enough failures of the share whose cause has the largest score
        named_N = np.array(CONCEPTS)[samples.scores.argmax(axis=1)]
        parts = {concept: samples.label == concept for concept in _frequent(samples)}
        recalls = [weighted_mean(named_N[of] == concept, weights_B_N[:, of]) for concept, of in parts.items()]
        measures[CAUSES] = np.mean(recalls, axis=0) if recalls else np.full(len(weights_B_N), np.nan)
    return measures


def _frequent(samples: answers.Judged) -> list[str]:
    return [concept for concept in CONCEPTS if (samples.label == concept).sum() >= FEWEST_OF_A_CAUSE]


def counted_of_scans(samples: answers.Judged, metric: str) -> np.ndarray:
    return np.isin(samples.label, _frequent(samples)) if metric == CAUSES else answers.counted(samples, metric)
