"""Causes of failed registrations of depth frames, where nothing was perturbed: part of Table IX."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.judged import CEILING, MEASURES, Judged, ceiling_of, joined, judged_by, measure
from gpca.causes.truth import BORDERLINE, FAILED, GEOMETRY, NOMINAL
from gpca.encoders.registry import encoders
from gpca.errors import InputError
from gpca.evaluation.intervals import REPEATS, Clustered, pigeonhole_weights
from gpca.evaluation.measures import ALL, intervals
from gpca.experiments.cause_tables import (
    AGAIN,
    COST_NOTE,
    COSTS,
    NOT_COMPARED,
    POINTS,
    SECTION,
    SHOWN,
    counts_and_calls,
    reads,
)
from gpca.experiments.diagnosis import TABLE, cause_costs, cause_titles, compared_samples
from gpca.experiments.experiment import Experiment
from gpca.experiments.frames import title_of_frames
from gpca.experiments.plan import Run
from gpca.experiments.result import numbers, table
from gpca.experiments.step import Plan, Step
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry, explainer_module
from gpca.frames.source import REAL_WORLD
from gpca.frames.starts import CARRIED, KINDS, LADDER, NATIVE, TRANSPLANTED
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, read_csv
from gpca.objects.canonical import BY_ICP
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.plugins import is_outside
from gpca.reporting.sheet import Row, Sheet, show, where
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import plain_cell
from gpca.reporting.tables.table import Column
from gpca.reporting.words import dataset_in_words, plural
from gpca.seeds import generator, seed_of_file

if TYPE_CHECKING:
    import pandas as pd

SAMPLE_COLUMNS = ("sample", "instance", "start", "dataset", "scene", "truth", "missed")
SAMPLES = "test_samples"
STATE = "state_accuracy"
TRUTH = "truth"  # in the place of an explainer: how many there are of a kind, ``count_<kind>``
PSEUDO = "pseudo_truth"  # in the place of a kind of start: those whose true pose was made by ICP
COUNTED = ("starts", "instances", "scenes", "objects", *LABELS, BORDERLINE, GEOMETRY, "missed")
FEWEST_FAILURES = 30  # of a kind, below which nothing is concluded from it


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Seeds for which the causes are measured and explained, and the explainers from outside."""
    explainers = config["diagnosis"]["explainers"]
    return {
        "frame_cause_seed": list(config["seeds"])[: config["real_world"]["causes"]["seeds"]],
        "outside_explainer": [name for name in explainers if is_outside(explainer_module(name, CAUSES))],
    }


EXPERIMENT = Experiment(name="frame_causes", names=names)


def _asked(plan: Plan, explainers: Iterable[str]) -> dict[str, Any]:
    """Settings of a job that asks some explainers of causes about depth frames."""
    section = plan.config["diagnosis"]
    asked = {"explainers": {name: section["explainers"][name] for name in explainers}}
    return section | {"icp": plan.config["registrations"]["icp"]} | asked


def _encoder_module(plan: Plan) -> str:
    return encoders()[plan.config["diagnosis"]["encoder"]["backbone"]].split(":")[0]


def _inside(plan: Plan) -> list[str]:
    return [name for name in plan.config["diagnosis"]["explainers"] if name not in plan.names["outside_explainer"]]


def _if_enacted(plan: Plan, files: str) -> str | list[str]:
    """Files of re-enactments, where an explainer of causes reads any."""
    read = [explainer_entry(name, CAUSES).reads for name in plan.config["diagnosis"]["explainers"]]
    return files if REENACTED in read else []


DIAGNOSE_FRAMES = Step(
    name="diagnose_frames",
    run="gpca.steps.diagnosis:diagnose_frames",
    inputs={
        "frame_causes": "frame_causes/seed{seed}.npz",
        "frame_reenactments": lambda plan, wildcards: _if_enacted(plan, "reenactments/{frames}/seed{seed}.npz"),
        "causes": "causes/{*source}/seed{seed}.npz",
        "descriptors": "descriptors/{*source}/seed{seed}.npz",
        "reenactments": lambda plan, wildcards: _if_enacted(plan, "reenactments/{*source}/seed{seed}.npz"),
        "encoders": "cause_encoders/{*source}/seed{seed}.pt",
        "embeddings": "cause_embeddings/{*source}/seed{seed}.npz",
    },
    outputs={"predictions": "frame_diagnoses/seed{seed}.csv"},
    settings=lambda plan, wildcards: _asked(plan, _inside(plan)),
    params={"source": REAL_WORLD},
    modules=lambda plan: [
        _encoder_module(plan),
        *(explainer_module(name, CAUSES) for name in _inside(plan)),
    ],
)
# Explainers from outside have jobs of their own, so that an edit of one leaves the others as they are.
DIAGNOSE_FRAMES_OUTSIDE = replace(
    DIAGNOSE_FRAMES,
    name="diagnose_frames_outside",
    outputs={"predictions": "frame_diagnoses/{outside_explainer}/seed{seed}.csv"},
    settings=lambda plan, wildcards: _asked(plan, [wildcards.outside_explainer]),
    modules=lambda plan: [_encoder_module(plan)],
    modules_of_job=lambda plan, wildcards: [explainer_module(wildcards.outside_explainer, CAUSES)],
)


@numbers(
    "frame_causes.csv",
    causes_files="frame_causes/seed{frame_cause_seed}.npz",
    sample_files="frame_causes/seed{frame_cause_seed}.csv",
    prediction_files="frame_diagnoses/seed{frame_cause_seed}.csv",
    outside_files="frame_diagnoses/{outside_explainer}/seed{frame_cause_seed}.csv",
)
def collect(
    run: Run,
    causes_files: Iterable[str | Path],
    sample_files: Iterable[str | Path],
    prediction_files: Iterable[str | Path],
    outside_files: Iterable[str | Path] = (),
) -> pd.DataFrame:
    """Measures of explainers that learned from no frame, with intervals; the source is ``real_rgbd/{kind of start}``.

    An instance counts once in a measure, however many starts and seeds it has, and intervals are over scenes, since
    frames of one scene are alike. Beside the measures stands the number of `SAMPLES`. Counts, of `COUNTED`, are of
    starts, and also those of each dataset, ``real_rgbd/{kind}/{dataset}``. Scenes whose truth was made by ICP are
    counted as `PSEUDO` and measure nothing.

    Args:
        causes_files, sample_files, prediction_files: one of each seed, in the same order, named ``…/seed{seed}.…``.
        outside_files: predictions of explainers from outside, each of one seed and named so too.

    Raises:
        InputError: files that cannot be read, or are of different samples.
    """
    import pandas as pd

    samples_of: dict[str, list[Judged]] = {}
    tested: list[pd.DataFrame] = []
    outside = list(outside_files)
    for seed, causes, samples, predictions in _seeds(causes_files, sample_files, prediction_files):
        further = [_predictions(path, causes) for path in outside if seed_of_file(path) == seed]
        predictions = pd.concat([predictions, *further])
        for explainer, rows in predictions.groupby("explainer", sort=False):
            samples_of.setdefault(str(explainer), []).append(judged_by(rows, causes, seed))
        samples_of.setdefault(CEILING, []).append(ceiling_of(causes, seed))
        truth = causes.truth
        state = np.where((truth.state == FAILED) & (truth.dominant == GEOMETRY), GEOMETRY, labels_of(truth))
        tested.append(samples.assign(state=state, seed=seed, object=causes.registrations.object_name))
    judged = {explainer: joined(parts) for explainer, parts in samples_of.items()}
    together = pd.concat(tested, ignore_index=True)
    together["scene"] = together["dataset"] + " " + together["scene"]
    records: list[tuple] = []
    for kind, starts in _by_kind(together):
        records += _counts(f"{REAL_WORLD}/{kind}", starts)
        for dataset, subset in starts.groupby("dataset"):
            records += _counts(f"{REAL_WORLD}/{kind}/{dataset}", subset)
        if kind != PSEUDO:
            records += _measures(kind, starts, {name: every.subset(starts.index) for name, every in judged.items()})
    return intervals(records, "causes of frames")


def _by_kind(samples: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Samples of each kind of start that there are, and those that test no ICP."""
    pseudo_N = samples["truth"] == BY_ICP
    chosen = {kind: (samples["start"] == kind) & ~pseudo_N for kind in KINDS} | {PSEUDO: pseudo_N}
    yield from ((kind, samples[rows]) for kind, rows in chosen.items() if rows.any())


def _measures(kind: str, samples: pd.DataFrame, judged: dict[str, Judged]) -> list[tuple]:
    scene_N = samples["scene"].to_numpy(str)
    drawn_B_N = pigeonhole_weights(generator("frame cause intervals", kind), scene_N)
    draws = Clustered(samples["seed"].to_numpy(), scene_N, np.vstack([np.ones(len(samples)), drawn_B_N]))
    once_N = 1 / samples.groupby("instance")["instance"].transform("size").to_numpy(float)

    def measured(each: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
        # The number of samples also where nothing else can be measured.
        return measure(each, weights_B_N * once_N) | {SAMPLES: np.full(len(weights_B_N), float(len(each)))}

    return compared_samples(f"{REAL_WORLD}/{kind}", judged, draws, measured, (SAMPLES, *MEASURES))


def _seeds(*file_lists: Iterable[str | Path]) -> Iterator[tuple[int, Causes, pd.DataFrame, pd.DataFrame]]:
    files = [list(paths) for paths in file_lists]
    if not files[0] or len({len(paths) for paths in files}) > 1:
        raise InputError("causes of frames", "need files of every seed", "give the same number of each kind")
    for causes_file, sample_file, prediction_file in zip(*files, strict=True):
        causes = Causes.load(causes_file)
        samples = read_csv(sample_file, SAMPLE_COLUMNS, others=ANY)
        _require_same(sample_file, samples, causes)
        yield seed_of_file(causes_file), causes, samples[list(SAMPLE_COLUMNS)], _predictions(prediction_file, causes)


def _predictions(path: str | Path, causes: Causes) -> pd.DataFrame:
    predictions = read_predictions(path, labels=("explainer",))
    for _, rows in predictions.groupby("explainer"):
        _require_same(path, rows, causes)
    return predictions


def _require_same(path: str | Path, rows: pd.DataFrame, causes: Causes) -> None:
    require_same_samples(path, rows, causes.registrations.arrays, "causes", ("sample",))


def _counts(source: str, samples: pd.DataFrame) -> list[tuple]:
    """Rows of the number of starts in each of `COUNTED`, without an interval or a rival."""
    counts = Counter(samples["state"].tolist())
    counts |= Counter({f"{name}s": samples[name].nunique() for name in ("instance", "scene", "object")})
    counts |= Counter(starts=len(samples), missed=int((samples["missed"] == "True").sum()))
    sizes = samples["seed"].nunique(), counts["scenes"], len(samples)
    return [
        (TABLE, source, TRUTH, f"count_{kind}", ALL, "", "", *sizes, float(counts[kind]), np.nan, np.nan)
        for kind in COUNTED
    ]


STARTS = {
    NATIVE: "Estimated in the image",
    CARRIED: "Carried over from a neighboring image",
    TRANSPLANTED: "Errors made elsewhere",
    LADDER: "Ladder of errors",
    PSEUDO: "Truth made by ICP",
}
MEASURED = {
    STATE: show(STATE, "State (%)"),
    "gain": show(STATE, SHOWN["gain"].title, where={"against": "untrained"}, **POINTS),
    "lead": show(STATE, SHOWN["lead"].title, where={"against": "rival"}, **POINTS),
    **{key: SHOWN[key] for key in ("regret", "tied_accuracy", "dominant_accuracy")},
    **{key: SHOWN[key] for key in ("false_alarm_rate", "auroc_failed", "average_precision", "spearman_attribution")},
    **{key: SHOWN[key] for key in ("nominal_calibration", "icp_calls", "samples")},
}


@table(
    SECTION,
    "Table IX on depth frames: nothing was perturbed",
    """Registrations of depth frames as they come: the sensor's own noise, what stands in front, and poses that
    estimators gave in that very image, in a neighboring one or elsewhere; beside these, the true pose with errors
    of fixed sizes. Their causes are measured as well, since mesh, pose and camera are known; the explainers have
    learned from the simulated ones alone. Where fewer than 30 failed, nothing is concluded.""",
    after="table9_causes",
    intervals="frame_causes.csv",
)
def table9_frames(run: Run, intervals):
    """How explainers that learned from simulated causes name those measured in frames, by kind of start."""
    explainers = cause_titles(run.config)
    costs = cause_costs(run.config, explainers) | COSTS
    counts = {kind: _counted(intervals, kind) for kind in STARTS if kind != PSEUDO}
    titles = {kind: _title(kind, of_kind) for kind, of_kind in counts.items() if of_kind}
    rows = [
        Row(
            [start, explainer, reads(costs[explainer[0]])],
            {"source": f"{REAL_WORLD}/{start[0]}", "method": explainer[0]},
            rival=explainer[0] != CEILING and _failed(counts[start[0]]) >= FEWEST_FAILURES,
        )
        for start in titles.items()
        for explainer in (explainers | AGAIN).items()
    ]
    heads = {"start": "Starts", "explainer": "Explainer", "reads": "Reads"}
    sheet = Sheet("table9_frames", heads, rows, MEASURED, intervals, more=counts_and_calls(costs))
    notes = (
        *(_in_words(kind, counts[kind]) for kind in titles),
        f"Too few: below {FEWEST_FAILURES} failures nothing is concluded, and no row is bold. The same holds for "
        "each cause by itself.",
        "An instance counts once, whatever its number of starts. In brackets: the 95 % interval of "
        f"{REPEATS} bootstrap draws over scenes. Bold: best of these starts.",
        "State: mean share of the nominal and of the failed that is called so. Over untrained, lead: State minus "
        "that of the best untrained row and of the best other row, on the same draws. n: starts that are nominal "
        "or failed. The others as in Table IX. The rule counts points against the part of the model that the "
        "camera would see, which is not what it was made for: here it is a control. A re-enactment also reads "
        "the mesh, the camera and the pixels of the object.",
        COST_NOTE,
    )
    frames = title_of_frames(run.config)
    caption = f"What is wrong with registrations of depth frames: {frames}; learned from simulated causes"
    return sheet.table(caption, "metric", notes, bold=[key for key in MEASURED if key not in NOT_COMPARED], same=1)


@table(
    SECTION,
    "What became of registrations of depth frames",
    """How many starts of each kind, on each dataset, ended where they should, and by which cause the others failed.""",
    after="table9_frames",
    intervals="frame_causes.csv",
)
def table9_frame_counts(run: Run, intervals):
    """How many registrations of each kind of start are nominal, borderline and failed, and by which cause."""
    shown = {"starts": "Starts", "instances": "Instances", "scenes": "Scenes", NOMINAL: "Nominal"}
    shown |= {BORDERLINE: "Borderline", "failed": "Failed"} | {name: f"By {name}" for name in CONCEPTS}
    shown |= {GEOMETRY: "Without a cause", "missed": "No correspondence"}
    builder = TableBuilder("table9_frame_counts", {"start": "Starts", "dataset": "Dataset"})
    for kind, title in STARTS.items():
        stem = f"{REAL_WORLD}/{kind}"
        sources = intervals.loc[intervals["source"].str.startswith(f"{stem}/"), "source"].unique()
        datasets = [name.removeprefix(f"{stem}/") for name in sorted(sources)]
        words_of = {"": "All"} | {name: dataset_in_words(name) for name in datasets}
        for dataset, words in words_of.items():
            if of := _counted(intervals, f"{kind}/{dataset}".removesuffix("/")):
                counts = {**of, "failed": _failed(of)}
                cells = {name: plain_cell(counts[name], 1, of["starts"]) for name in shown}
                builder.add_row([(kind, title), (dataset or "all", words)], cells)
    return builder.build(
        caption=f"What became of registrations of depth frames: {title_of_frames(run.config)}",
        column_head="count",
        columns={name: Column(title, 0, False, (0.0, inf)) for name, title in shown.items()},
        footnotes=(
            "Every estimator's pose of an instance is a start by itself. By a cause: it adds most to the error, as "
            "Table IX measures it. Without a cause: off even with every cause removed; not among the failed.",
            "No correspondence: ICP found none from any start around this one, and so did not move. These count by "
            "their state like all others.",
            "Truth made by ICP: the true poses were found by ICP themselves, so these test no ICP and are counted here "
            "alone.",
        ),
    )


def _counted(intervals: pd.DataFrame, kind: str) -> dict[str, int]:
    """Counts of a kind of start, by name; none where there are no such starts."""
    rows = where(intervals, {"source": f"{REAL_WORLD}/{kind}", "method": TRUTH})
    named = zip(rows["metric"], rows["value"], strict=True)
    return {metric.removeprefix("count_"): int(value) for metric, value in named}


def _failed(counts: Mapping[str, int]) -> int:
    return sum(counts[concept] for concept in CONCEPTS)


def _title(kind: str, counts: Mapping[str, int]) -> str:
    failed = _failed(counts)
    few = ", too few" if failed < FEWEST_FAILURES else ""
    return f"{STARTS[kind]} ({failed} failed{few})"


def _in_words(kind: str, counts: Mapping[str, int]) -> str:
    """Sentence that counts the starts of a kind."""
    by_cause = ", ".join(f"{counts[concept]} mostly by {concept}" for concept in CONCEPTS)
    most, failed = max(counts[concept] for concept in CONCEPTS), _failed(counts)
    constant = f" One constant answer names {100 * most / failed:.0f} % of these." if failed else ""
    return (
        f"{STARTS[kind]}: {plural(counts['starts'], 'start')} of {plural(counts['instances'], 'instance')} in "
        f"{plural(counts['scenes'], 'scene')}; {counts[NOMINAL]} nominal, {counts[BORDERLINE]} borderline, "
        f"{counts[GEOMETRY]} off without a cause, {failed} failed: {by_cause}.{constant}"
    )
