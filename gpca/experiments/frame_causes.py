"""Causes of failed registrations of depth frames, where nothing was perturbed: part of Table IX."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gpca.alignment.methods.registry import method_entry
from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.judged import CEILING, MEASURES, Judged, ceiling_of, joined, judged_by, measure
from gpca.causes.truth import BORDERLINE, FAILED, GEOMETRY, NOMINAL, Truth
from gpca.declarations import Experiment, Frame, Paths, Plan, Run, Step, numbers, table
from gpca.evaluation.intervals import FEWEST_FAILURES, REPEATS, Clustered, pigeonhole_weights
from gpca.evaluation.measures import ALL, intervals
from gpca.experiments import cause_tables as tables
from gpca.experiments.diagnosis import FURTHER, TABLE, cause_costs, cause_titles, compared_samples, explaining_modules
from gpca.experiments.frames import title_of_frames
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.frames.instances import CARRIED, KINDS, LADDER, NATIVE, TRANSPLANTED
from gpca.frames.source import REAL_WORLD
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, read_csv
from gpca.objects.canonical import BY_ICP
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Cell, Column, Row, Sheet, dataset_in_words, plain_cell, plural, show, where
from gpca.seeds import generator, seed_of_file

SAMPLE_COLUMNS = ("sample", "instance", "start", "dataset", "scene", "truth", "missed")
SAMPLES = "test_samples"
STATE = "state_accuracy"
TRUTH = "truth"  # in the place of an explainer: how many there are of a kind, ``count_<kind>``
PSEUDO = "pseudo_truth"  # in the place of a kind of start: those whose true pose was made by ICP
FAILED_BY = "failed_"  # and a method: columns of the samples
COUNTED = ("starts", "instances", "scenes", "objects", *LABELS, BORDERLINE, GEOMETRY, "missed")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Seeds for which the causes are measured and explained."""
    return {"frame_cause_seed": list(config["seeds"])[: config["real_world"]["causes"]["seeds"]]}


EXPERIMENT = Experiment(name="frame_causes", names=names)


def _if_read(plan: Plan, files: str) -> str | list[str]:
    """Files of re-enactments or further samples, where an explainer of causes reads any."""
    entries = [explainer_entry(name, CAUSES) for name in plan.config["diagnosis"]["explainers"]]
    read = (entry.further if files == FURTHER else entry.reads == REENACTED for entry in entries)
    return files if any(read) else []


DIAGNOSE_FRAMES = Step(
    name="diagnose_frames",
    run="gpca.steps.diagnosis:diagnose_frames",
    inputs={
        "frame_causes": "frame_causes/seed{seed}.npz",
        "frame_reenactments": lambda plan, wildcards: _if_read(plan, "reenactments/{frames}/seed{seed}.npz"),
        "causes": "causes/{*source}/seed{seed}.npz",
        "descriptors": "descriptors/{*source}/seed{seed}.npz",
        "reenactments": lambda plan, wildcards: _if_read(plan, "reenactments/{*source}/seed{seed}.npz"),
        "further": lambda plan, wildcards: _if_read(plan, FURTHER),
        "encoders": "cause_encoders/{*source}/seed{seed}.pt",
        "embeddings": "cause_embeddings/{*source}/seed{seed}.npz",
    },
    outputs={"predictions": "frame_diagnoses/seed{seed}.csv"},
    settings=lambda plan, wildcards: plan.config["diagnosis"] | {"icp": plan.config["registrations"]["icp"]},
    params={"source": REAL_WORLD},
    modules=lambda plan: explaining_modules(plan, plan.config["diagnosis"]["explainers"]),
)


@numbers(
    "frame_causes.csv",
    causes_files="frame_causes/seed{frame_cause_seed}.npz",
    sample_files="frame_causes/seed{frame_cause_seed}.csv",
    prediction_files="frame_diagnoses/seed{frame_cause_seed}.csv",
)
def collect(run: Run, causes_files: Paths, sample_files: Paths, prediction_files: Paths) -> Frame:
    """Measures of explainers that learned from no frame, with intervals; the source is ``real_rgbd/{kind of start}``.

    An instance counts once in a measure, however many starts and seeds it has, and intervals are over scenes. Counts,
    of `COUNTED`, are of starts, also of each dataset, ``real_rgbd/{kind}/{dataset}``. Scenes whose truth was made by
    ICP are counted as `PSEUDO` and measure nothing. Files are in the same order of seeds.
    """
    import pandas as pd

    samples_of: dict[str, list[Judged]] = {}
    tested: list[Frame] = []
    for causes_file, sample_file, prediction_file in zip(causes_files, sample_files, prediction_files, strict=True):
        causes, seed = Causes.load(causes_file), seed_of_file(causes_file)
        samples = read_csv(sample_file, SAMPLE_COLUMNS, others=ANY)
        samples = samples[[name for name in samples if name in SAMPLE_COLUMNS or name.startswith(FAILED_BY)]]
        require_same_samples(sample_file, samples, causes.registrations.arrays, "causes", ("sample",))
        predicted = read_predictions(prediction_file, labels=("explainer",))
        for explainer, rows in predicted.groupby("explainer", sort=False):
            require_same_samples(prediction_file, rows, causes.registrations.arrays, "causes", ("sample",))
            samples_of.setdefault(str(explainer), []).append(judged_by(rows, causes, seed))
        samples_of.setdefault(CEILING, []).append(ceiling_of(causes, seed))
        tested.append(samples.assign(end=ends_of(causes.truth), seed=seed, object=causes.registrations.object_name))
    judged = {explainer: joined(parts) for explainer, parts in samples_of.items()}
    together = pd.concat(tested, ignore_index=True)
    together["scene"] = together["dataset"] + " " + together["scene"]
    kind_N, records = together["start"].mask(together["truth"] == BY_ICP, PSEUDO), []
    for kind in (*KINDS, PSEUDO):
        starts, source = together[kind_N == kind], f"{REAL_WORLD}/{kind}"
        of_datasets = {f"{source}/{dataset}": subset for dataset, subset in starts.groupby("dataset")}
        for name, subset in ({source: starts} | of_datasets).items() if len(starts) else ():
            ends = count_ends(subset, ("instance", "scene", "object"), "starts")
            sizes = subset["seed"].nunique(), ends["scenes"], len(subset)
            records += [
                (TABLE, name, TRUTH, f"count_{each}", ALL, "", "", *sizes, float(count), np.nan, np.nan)
                for each, count in ({each: ends[each] for each in COUNTED} | failures_by_method(subset)).items()
            ]
        if kind == PSEUDO or starts.empty:
            continue
        seed_N, scene_N, instance_N = (starts[name].to_numpy() for name in ("seed", "scene", "instance"))
        drawn_B_N = pigeonhole_weights(generator("frame cause intervals", kind), scene_N.astype(str))
        draws = Clustered(seed_N, scene_N, np.vstack([np.ones(len(starts)), drawn_B_N]), instance_N)

        def measured(each: Judged, weights_B_N: np.ndarray, once_N: np.ndarray = draws.once) -> dict[str, np.ndarray]:
            # The number of samples also where nothing else can be measured.
            return measure(each, weights_B_N * once_N) | {SAMPLES: np.full(len(weights_B_N), float(len(each)))}

        of_kind = {name: every.subset(starts.index) for name, every in judged.items()}
        records += compared_samples(source, of_kind, draws, measured, (SAMPLES, *MEASURES))
    return intervals(records, "causes of frames")


def ends_of(truth: Truth) -> np.ndarray:
    """Label of each registration, `GEOMETRY` for those that failed without a cause."""
    return np.where((truth.state == FAILED) & (truth.dominant == GEOMETRY), GEOMETRY, labels_of(truth))


def count_ends(samples: Frame, things: Iterable[str], whole: str) -> Counter[str]:
    """Numbers of samples by their `end`, of different things among them, and of all, by the name `whole`."""
    counts: Counter[str] = Counter(samples["end"].tolist())
    counts.update({f"{name}s": samples[name].nunique() for name in things})
    counts.update({whole: len(samples), "missed": int((samples["missed"] == "True").sum())})
    return counts


def failures_by_method(samples: Frame) -> dict[str, int]:
    """Numbers of samples whose own error is too large by each method and by any, and in how many scenes."""
    failed = samples[[name for name in samples if name.startswith(FAILED_BY)]] == "True"
    if failed.empty:
        return {}
    scenes = samples["scene"][failed.any(axis=1)].nunique()
    return {**failed.sum(), "failures": failed.to_numpy().sum(), "failed_scenes": scenes}


def counts_in(rows: Frame) -> dict[str, int]:
    """Counts by name, and the number that `failed` by a cause; nothing where there are none."""
    named = zip(rows["metric"], rows["value"], strict=True)
    counts = {metric.removeprefix("count_"): int(value) for metric, value in named}
    return counts | {"failed": sum(counts[concept] for concept in CONCEPTS)} if counts else {}


STARTS = {
    NATIVE: "Estimated in the image",
    CARRIED: "Carried over from a neighboring image",
    TRANSPLANTED: "Errors made elsewhere",
    LADDER: "Ladder of errors",
    PSEUDO: "Truth made by ICP",
}
ENDS = {NOMINAL: "Nominal", BORDERLINE: "Borderline", "failed": "Failed"}
ENDS |= {**{name: f"By {name}" for name in CONCEPTS}, GEOMETRY: "Without a cause", "missed": "No correspondence"}
MISSED_NOTE = (
    "No correspondence: ICP found none from any start around this one, and so did not move. These count by their state "
    "like all others."
)
MEASURED = {
    STATE: show(STATE, "State (%)"),
    "gain": show(STATE, tables.SHOWN["gain"].title, where={"against": "trivial"}, **tables.POINTS),
    "lead": show(STATE, tables.SHOWN["lead"].title, where={"against": "rival"}, **tables.POINTS),
    **{key: each for key, each in tables.SHOWN.items() if key not in ("gain", "lead", "balanced_accuracy")},
}


@table(
    tables.SECTION,
    "Table IX on depth frames: nothing was perturbed",
    """Registrations of depth frames as they come: the sensor's own noise, what stands in front, and poses that
    estimators gave in that image, in a neighboring one or elsewhere; beside these, the true pose with errors of fixed
    sizes. The explainers have learned from simulated causes alone.""",
    after="table9_causes",
    intervals="frame_causes.csv",
)
def table9_frames(run: Run, intervals):
    explainers = cause_titles(run.config)
    costs, rows, counted = cause_costs(run.config, explainers) | tables.COSTS, [], []
    for kind, title in STARTS.items():
        source = {"source": f"{REAL_WORLD}/{kind}"}
        of = counts_in(where(intervals, source | {"method": TRUTH}))
        if kind == PSEUDO or not of:
            continue
        failed, most = of["failed"], max(of[concept] for concept in CONCEPTS)
        is_enough = failed >= FEWEST_FAILURES
        start = (kind, f"{title} ({failed} failed{'' if is_enough else ', too few'})")
        for name, words in (explainers | tables.AGAIN).items():
            labels = [start, (name, words), (costs[name]["sees"],) * 2]
            rows.append(Row(labels, source | {"method": name}, rival=is_enough and name != CEILING))
        by_cause = ", ".join(f"{of[concept]} mostly by {concept}" for concept in CONCEPTS)
        constant = f" One constant answer names {100 * most / failed:.0f} % of these." if failed else ""
        counted.append(
            f"{title}: {plural(of['starts'], 'start')} of {plural(of['instances'], 'instance')} in "
            f"{plural(of['scenes'], 'scene')}; {of[NOMINAL]} nominal, {of[BORDERLINE]} borderline, "
            f"{of[GEOMETRY]} off without a cause, {failed} failed: {by_cause}.{constant}"
        )
    heads = {"start": "Starts", "explainer": "Explainer", "reads": "Reads"}
    sheet = Sheet("table9_frames", heads, rows, MEASURED, intervals, more=tables.counts_and_calls(costs))
    notes = (
        *counted,
        f"Too few: below {FEWEST_FAILURES} failures nothing is concluded, and no row is bold. The same holds for "
        "each cause by itself.",
        "An instance counts once, whatever its number of starts. In brackets: the 95 % interval of "
        f"{REPEATS} bootstrap draws over scenes. Bold: best of these starts.",
        "State: mean share of the nominal and of the failed that is called so. Over trivial, lead: State minus that "
        "of the best trivial row and of the best other row, on the same draws. n: starts that are nominal or failed. "
        "The others as in Table IX. A re-enactment also reads the mesh, the camera and the pixels of the object.",
        tables.COST_NOTE,
    )
    frames, bold = title_of_frames(run.config), [key for key in MEASURED if key not in tables.NOT_COMPARED]
    caption = f"What is wrong with registrations of depth frames: {frames}; learned from simulated causes"
    return sheet.table(caption, "metric", notes, bold=bold, same=1)


@table(
    tables.SECTION,
    "What became of registrations of depth frames",
    """How many starts of each kind, on each dataset, ended where they should, and by which cause the others failed.""",
    after="table9_frames",
    intervals="frame_causes.csv",
)
def table9_frame_counts(run: Run, intervals):
    rows = []
    for start in STARTS.items():
        whole = f"{REAL_WORLD}/{start[0]}"
        rows.append(Row([start, ("all", "All")], {"source": whole}))
        for source in sorted({name for name in intervals["source"] if name.startswith(f"{whole}/")}):
            dataset = source.removeprefix(f"{whole}/")
            rows.append(Row([start, (dataset, dataset_in_words(dataset))], {"source": source}))
    metrics, prefix = dict.fromkeys(intervals["metric"]), f"count_{FAILED_BY}"
    methods = [metric.removeprefix(prefix) for metric in metrics if metric.startswith(prefix)]
    titles = {"starts": "Starts", "instances": "Instances", "scenes": "Scenes"} | ENDS
    titles |= {FAILED_BY + name: f"Off by {method_entry(name).title}" for name in methods if name != "scenes"}
    titles |= {"failures": "Off, all methods", "failed_scenes": "in scenes"} if methods else {}
    notes = (
        "By a cause: it adds most to the error. Without a cause: off even with every cause removed; not among the "
        "failed.",
        MISSED_NOTE,
        "Off by a method: its one registration from that start ends more than the limit of a failure away. Failed is "
        "the mean over starts around it. Truth made by ICP: these test no ICP and are counted here alone.",
    )
    caption = f"What became of registrations of depth frames: {title_of_frames(run.config)}"
    heads = {"start": "Starts", "dataset": "Dataset"}
    return sheet_of_counts("table9_frame_counts", heads, rows, titles, intervals).table(caption, "count", notes)


def sheet_of_counts(
    name: str, heads: Mapping[str, str], rows: Iterable[Row], titles: Mapping[str, str], measured: Frame
) -> Sheet:
    """Sheet of the counts with these titles, of which the first is of all."""
    whole = next(iter(titles))

    def more(_row: Row, subset: Frame) -> dict[str, Cell]:
        counts = counts_in(subset)
        return {key: plain_cell(counts[key], 1, counts[whole]) for key in titles}

    columns = {key: Column(title, **tables.COUNTS) for key, title in titles.items()}
    return Sheet(name, heads, rows, columns, where(measured, {"method": TRUTH}), more=more)
