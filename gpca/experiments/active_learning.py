"""Labels that a classifier needs for a concept that it has never seen, by every strategy (Table III)."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from gpca.active_learning.acquisition import STREAMS, strategies, strategy_module
from gpca.active_learning.curves import TABLE, collect_curves
from gpca.active_learning.settings import LOOK_EVERY, ActiveLearningSettings, RareSettings, StreamSettings, rare_setting
from gpca.declarations import Experiment, Figure, Frame, LeftOut, Names, Paths, Plan, Run, Step, figure, numbers, table
from gpca.encoders.registry import EncoderChanges, require_draws
from gpca.errors import require_names
from gpca.experiments.label_curves import (
    COUNT,
    STYLES,
    Clusters,
    draw_curves,
    families,
    label_cells,
    mean_curves,
    quantity,
)
from gpca.pairs.perturbation import Concept
from gpca.reporting.sheet import Sheet, Show, Table, crossed, plural
from gpca.reporting.tables.builder import cautious_over
from gpca.settings import Distinct, PositiveShare

NAME = "active_learning"
PAPERS_HELD_OUT = "overlap"  # the paper's GPC knows noise and pose (Sec. IV-C)
SETTINGS = {"pretrained": "all concepts", "unseen": "the known concepts only"}
ROWS = {
    "pretrained": "encoder saw\nall concepts",
    "unseen": "encoder never saw\nthe new concept",
    "rare_5": "encoder saw all;\n5 % of the pool new",
}


def titles(names: Iterable[str] | None = None) -> dict[str, str]:
    """Title of each strategy, or of those with these names."""
    every = {name: strategy.title for name, strategy in strategies().items()} | STREAMS
    return every if names is None else {name: every[name] for name in names}


@dataclass(frozen=True, kw_only=True)
class Section(ActiveLearningSettings):
    """The rounds, the concepts that the classifier has never seen, and the encoder that has not seen them either."""

    held_out: Distinct[Concept]
    target: PositiveShare
    rare: RareSettings
    without: EncoderChanges
    stream: StreamSettings
    strategies: Distinct[str]


def check(config: dict, _left_out: LeftOut) -> None:
    """Check the names of the strategies, and the encoder that never sees the concept."""
    learning = config["active_learning"]
    require_names("active_learning.strategies", learning["strategies"], titles(), "strategy")
    encoder = config["encoders"][config["embedding"]["encoder"]] | learning["without"]
    points = config["registrations"]["cloud_points"]
    require_draws("active_learning.without", encoder, points, "registrations.cloud_points")


EXPERIMENT = Experiment(
    name=NAME,
    sections={"active_learning": Section},
    names=lambda config, sources: {
        "strategy": list(config[NAME]["strategies"]),
        "pool_strategy": [name for name in config[NAME]["strategies"] if name not in STREAMS],
        "further_concept": [name for name in config[NAME]["held_out"] if name != PAPERS_HELD_OUT],
    },
    check=check,
    switches={"active_learning.strategies": Names("strategy", titles)},
)


def learning_settings(plan: Plan) -> dict[str, Any]:
    """Settings of all strategies; their names are none of these, so that another one leaves their files unchanged."""
    return {key: value for key, value in plan.config["active_learning"].items() if key != "strategies"}


def _seed_settings(plan: Plan, wildcards: Any) -> dict[str, Any]:
    """Settings of a seed; seeds beyond the first few have one share of a rare concept."""
    settings = learning_settings(plan)
    rare = settings["rare"]
    beside = int(wildcards.seed) in plan.config["seeds"][: rare.get("beside_seeds")]
    return settings if beside else settings | {"rare": rare | {"shares": rare["shares"][:1]}}


EMBED_WITHOUT = Step(
    name="embed_without",
    run="gpca.steps.active_learning:embed_without",
    inputs={"registrations": "registrations/{source}/seed{seed}.npz"},
    outputs={"out": "embeddings/{source}/without/seed{seed}.npz"},
    settings=lambda plan, wildcards: plan.encoder | plan.config["active_learning"]["without"],
    params={"concepts": lambda plan, wildcards: plan.config["active_learning"]["held_out"]},
    modules=lambda plan: [plan.encoder_module],
    priority=7,
)
LEARN = Step(
    name="learn_actively",
    run="gpca.steps.active_learning:learn_actively",
    inputs={
        "registrations": "registrations/{source}/seed{seed}.npz",
        "embeddings": "embeddings/{source}/{embedding}/seed{seed}.npz",
        "embeddings_without": "embeddings/{source}/without/seed{seed}.npz",
    },
    outputs={"out": "active_learning/{source}/{*strategy}/seed{seed}.csv"},
    settings=_seed_settings,
    modules=lambda plan: [strategy_module(name) for name in plan.names["strategy"] if name not in STREAMS],
    priority=4,
)


@numbers("active_learning.csv", files="active_learning/{source}/{strategy}/seed{seed}.csv")
def collect(run: Run, files: Paths) -> Frame:
    """Labels to the target, accuracies and areas of all learning curves, by seed."""
    return collect_curves(files, run.config["active_learning"]["target"])


SECTION = "IV-C Active learning via BALD"
INPUTS = {"metrics": "active_learning.csv", "clusters": (families, "registrations/{source}/seed{seed}.npz")}
CURVES = {"curve_files": "active_learning/{source}/{pool_strategy}/seed{seed}.csv"}


@table(
    SECTION,
    "Table III: labels needed for a new concept",
    """Table III of the paper: how many labels, chosen by BALD with k-means, by BALD or at random, a classifier needs
    for a concept that it has never seen. Rows differ in the share of the new concept in the pool and in whether the
    encoder had seen it, which the paper leaves open; the row with 5 % follows it.""",
    paper=True,
    **INPUTS,
)
def table3_active_learning(run: Run, metrics: Frame, clusters: Clusters) -> Table:
    learning = run.config["active_learning"]
    rare, gpc, few = learning["rare"], learning["rare"]["gpc"], learning["rare"].get("beside_seeds")
    settings = {rare_setting(share): f"all concepts; {100 * share:g} % of the pool new" for share in rare["shares"]}
    labels = {
        "labels_bald_kmeans": quantity("labels_to_target", "Labels, BALD + k-means", "bald_kmeans", **COUNT),
        "labels_bald": quantity("labels_to_target", "Labels, BALD", "bald", **COUNT),
        "labels_random": quantity("labels_to_target", "Labels, random", "random", **COUNT),
    }
    columns = labels | {
        "accuracy_bald_kmeans": quantity("final_accuracy", "Acc. BALD (%)", "bald_kmeans"),
        "accuracy_random": quantity("final_accuracy", "Acc. random (%)", "random"),
        "epochs_bald_kmeans": quantity("epochs_at_target", "Epochs", "bald_kmeans", **COUNT),
    }
    beside = f" Shares but the first: over at most the first {plural(few, 'seed')}." if few else ""
    notes = [
        "Where so many percent of the pool are new (5 % are compared with the paper), the paper's classifier "
        f"({gpc['kernel']}, rate {gpc['learning_rate']:g}, {gpc['iterations']} passes) is fitted anew in each round "
        f"(docs/comparison.md): of {rare['batch']} labels, of {rare['late_batch']} from {rare['least']} on, at most "
        f"{rare['labels']}. Epochs are counted in steps of {LOOK_EVERY}.{beside}",
        f"Other rows: {_protocol(run)} Retraining moves the posterior alone, in at most "
        f"{learning['iterations']} passes over the labels. Epochs: passes that reached the target. Acc.: after all "
        "labels.",
    ]
    caption = f"Labels until a GPC that knew noise and pose reaches {learning['target']:.0%} on all concepts"
    axes = {"source": run.source_titles, "setting": settings | SETTINGS}
    metrics = metrics[metrics["concept"] == PAPERS_HELD_OUT]
    return _table(run, "table3_active_learning", axes, columns, metrics, clusters, caption, notes, bold_across=labels)


FINAL = {
    "final_accuracy": quantity("final_accuracy", "Accuracy (%)"),
    "final_accuracy_new": quantity("final_accuracy_new", "New (%)"),
}
HEADS = {"source": ("source", "Dataset"), "setting": ("setting", "Encoder saw"), "method": ("strategy", "Strategy")}


def _table(
    run: Run,
    name: str,
    axes: Mapping[str, Mapping[str, str]],
    columns: Mapping[str, Show],
    metrics: Frame,
    clusters: Clusters,
    caption: str,
    notes: Iterable[str],
    **compared: Any,
) -> Table:
    test, oracles = run.config["registrations"]["test"], [key for key, each in strategies().items() if each.oracle]
    rows = [replace(row, rival=row.where.get("method") not in oracles) for row in crossed(*axes.items())]
    metrics = metrics.assign(setting=metrics["table"].str.removeprefix(TABLE))
    heads = dict(HEADS[axis] for axis in axes)
    sheet = Sheet(name, heads, rows, columns, metrics, cell=label_cells(test, clusters))
    notes = (f"{cautious_over(sheet.seeds, test)}.", *notes)
    return sheet.table(caption + run.stand_ins(), "quantity", notes, keep_empty=True, **compared)


@figure(
    SECTION,
    "Learning curves",
    """Accuracy over the number of labels, by strategy: the mean over the concepts, each held out in turn, and over the
    seeds. The paper's two strategies are thick, with 95 % intervals. Last row: its classifier, few new in the pool.""",
    **CURVES,
)
def active_learning_curves(run: Run, curve_files: Paths) -> Figure:
    return _draw(run, curve_files)


@figure(
    SECTION,
    "Learning curves, overlap held out",
    "The paper's experiment alone, where other concepts are held out, too.",
    needs=("further_concept",),
    **CURVES,
)
def active_learning_overlap(run: Run, curve_files: Paths) -> Figure:
    return _draw(run, curve_files, (PAPERS_HELD_OUT,))


def _draw(run: Run, files: Paths, held_out: Collection[str] | None = None) -> Figure:
    lines, target = titles(run.config["active_learning"]["strategies"]), run.config["active_learning"]["target"]
    by_strategy = mean_curves(files, held_out).items()
    curves = {(source, setting, strategy): curve for (source, strategy, setting), curve in by_strategy}
    return draw_curves(curves, run.source_titles, ROWS, lines, STYLES, target)


@table(
    SECTION,
    "Table III, extended: every strategy",
    """Every acquisition strategy, for each concept held out in turn. Compare rows of one dataset and setting: they
    start from the same labels. Area gain is the mean accuracy over the budget minus that of random choice.""",
    **INPUTS,
)
def table3_extended(run: Run, metrics: Frame, clusters: Clusters) -> Table:
    learning = run.config["active_learning"]
    columns = {
        f"labels_{c}": quantity("labels_to_target", f"Labels, {c}", concept=c, **COUNT)
        for c in metrics["concept"].unique()
    } | {
        "reached": quantity("reached", "Reached (%)", decimals=0, interval=False),
        **FINAL,
        "area_under_curve": quantity("area_under_curve", "Area (%)"),
        "area_gain": quantity("area_gain", "Gain (%)", limits=(-100, 100)),
    }
    notes = [
        _protocol(run),
        "Labels: until the target, by the concept held out. Accuracy: after all labels; New: that on the concept "
        "held out. Gain: area minus that of random sampling from the same start. All but Labels: means over the "
        "concepts held out.",
    ]
    caption = f"Active learning of a held-out concept by every strategy, to {learning['target']:.0%}"
    pool = titles(name for name in learning["strategies"] if name not in STREAMS)
    axes = {"source": run.source_titles, "setting": SETTINGS, "method": pool}
    bold = [key for key in columns if key != "reached"]
    return _table(run, "table3_extended", axes, columns, metrics, clusters, caption, notes, bold=bold, same=2)


@table(
    SECTION,
    "Table III on a stream",
    """Samples arrive one by one, and a label must be requested at once or never: how soon is the new concept known?""",
    **INPUTS,
)
def table3_stream(run: Run, metrics: Frame, clusters: Clusters) -> Table:
    learning = run.config["active_learning"]
    stream = learning["stream"]
    concepts = metrics["concept"].unique()
    columns = {f"delay_{c}": quantity("delay", f"Delay, {c}", concept=c, **COUNT) for c in concepts} | {
        "labels": quantity("labels", "Labels", interval=False, **COUNT),
        "new_labels": quantity("new_labels", "Labels of the new", interval=False, **COUNT),
        "running_accuracy": quantity("running_accuracy", "Running (%)"),
        **FINAL,
    }
    notes = [
        f"{stream['arrivals']} samples, the first {stream['quiet']} of the two known concepts, of the others a third "
        f"new; a label may be requested for {stream['budget']:.0%} of them. Delay: arrivals from the first new sample "
        "until half of its concept's test samples are named right; '>': some runs ended before. Running: accuracy "
        "over the last arrivals, each judged before its label is known. All but Delay: means over the concepts held "
        "out."
    ]
    axes = {"source": run.source_titles, "method": titles(name for name in learning["strategies"] if name in STREAMS)}
    metrics, caption = metrics[metrics["table"] == f"{TABLE}pretrained"], "A new concept in a stream of registrations"
    bold = [key for key in columns if "labels" not in key]
    return _table(run, "table3_stream", axes, columns, metrics, clusters, caption, notes, bold=bold, same=1)


def _protocol(run: Run) -> str:
    learning, train = run.config["active_learning"], run.config["registrations"]["train"]
    return (
        f"Start: {learning['initial']} labeled samples of the two known concepts. Pool: the other "
        f"{train - learning['initial']} training samples, with all of the new concept, a third of {train}. "
        f"{learning['batch']} labels a round, {learning['labels']} in all; '>': some runs did not reach the target "
        "and count with all labels."
    )
