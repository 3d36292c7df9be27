"""Labels that a classifier needs for a new concept on depth frames (Sec. IV-E); their numbers join those of frames."""

from collections.abc import Iterable
from dataclasses import replace

from gpca.active_learning.curves import TABLE, collect_curves
from gpca.active_learning.settings import ALL_LABELS, FRAME_STRATEGIES, PAIR, FrameLabelSettings
from gpca.declarations import Experiment, Frame, LeftOut, Paths, Run, Step, table
from gpca.errors import InputError, require_names
from gpca.experiments.frames import encoder_title, title_of_frames
from gpca.experiments.label_curves import COUNT, label_cells, quantity
from gpca.frames.source import REAL_WORLD
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Sheet, Show, Table, crossed
from gpca.reporting.tables.builder import mean_over

TO_TARGET = ("labels_to_target", "epochs_to_target", "reached")  # metrics that differ by target accuracy
ONE_TARGET = "epochs_at_target"  # left out, because there are several targets


def in_percent(target: float) -> str:
    """A target as in the column `table` of the metrics."""
    return f"{100 * target:.0f}"


def check(config: dict, left_out: LeftOut) -> None:
    """Check the backbones, that the targets differ in percent, and that the labels at the start leave a pool."""
    section, train = config["frame_labels"], config["real_world"]["train"]
    require_names("frame_labels.backbones", section["backbones"], config["encoders"], "encoder", left_out("encoders"))
    if len(set(map(in_percent, section["targets"]))) < len(section["targets"]):
        raise InputError("config key frame_labels.targets", "two are equal in whole percent", "remove one")
    if (initial := section["initial"]) // 2 >= train // len(CONCEPTS):  # a third of the samples is of each concept
        fault = f"{initial} labeled samples of two concepts leave none of {train} training samples for the pool"
        raise InputError("config key frame_labels.initial", fault, "lower it or raise real_world.train")


EXPERIMENT = Experiment(
    name="frame_labels",
    sections={"frame_labels": FrameLabelSettings},
    names=lambda config, sources: {
        "frame_label_strategy": list(FRAME_STRATEGIES),
        "frame_label_seed": list(config["seeds"])[: config["frame_labels"]["seeds"]],
        "frame_label_backbone": [
            name for name in config["real_world"]["backbones"] if name in config["frame_labels"]["backbones"]
        ],
    },
    check=check,
    lists={"frame_labels.backbones": "encoders"},
)

LEARN = Step(
    name="learn_on_frames",
    run="gpca.steps.active_learning:learn_on_frames",
    inputs={
        "registrations": "registrations/{frames}/seed{seed}.npz",
        "embeddings": "embeddings/{frames}/{*frame_label_backbone}/none/seed{seed}.npz",
    },
    outputs={"out": "frame_labels/{frames}/{*strategy}/seed{seed}.csv"},
    where={"strategy": "frame_label_strategy"},
    settings=lambda plan, wildcards: {
        "frame_labels": plan.config["frame_labels"],
        "active_learning": {"rare": plan.config["active_learning"]["rare"]},
    },
    params={"source": REAL_WORLD, "backbones": lambda plan, wildcards: plan.names["frame_label_backbone"]},
    priority=4,
)


def collect_labels(label_files: Paths, targets: Iterable[float]) -> list[Frame]:
    """Metrics of learning curves on depth frames, by seed, for targets of the accuracy on the test samples.

    The column `table` names the embedding, ``active_learning/{backbone}`` or ``active_learning/pair``. Metrics that
    depend on the target have it in percent behind, ``active_learning/{backbone}/70``.
    """
    by_target = {in_percent(target): collect_curves(label_files, target) for target in targets}
    whole = next(iter(by_target.values()))
    return [whole[~whole["metric"].isin((*TO_TARGET, ONE_TARGET))]] + [
        curves[curves["metric"].isin(TO_TARGET)].assign(table=lambda rows, end=percent: rows["table"] + f"/{end}")
        for percent, curves in by_target.items()
    ]


STRATEGIES = {"bald_kmeans": "BALD, to {} % (labels)", "random": "Random, to {} % (labels)"}
ENDS = {  # columns beside the labels to the targets
    "start": quantity("start_accuracy", "Start (%)", "random", interval=False),
    "final": quantity("final_accuracy", "BALD, all queries (%)", "bald_kmeans"),
    "all_labels": quantity("final_accuracy", "All labels (%)", ALL_LABELS),
}


@table(
    "IV-E Real-world validation",
    "Depth frames: labels needed for a new concept",
    """How many labels a classifier needs on depth frames, chosen by BALD with k-means or at random, to the paper's
    target of 70 % and to its neighbors (Sec. IV-E): on the embeddings of two backbones and on measurements of the
    pair.""",
    after="confusion_real_world",
    metrics="real_world.csv",
)
def table6_labels(run: Run, metrics: Frame) -> Table:
    section, frames = run.config["frame_labels"], run.config["real_world"]
    percents = [in_percent(target) for target in section["targets"]]
    columns = {
        f"{strategy}_{percent}": Show(
            title.format(percent), where={"metric": "labels_to_target", "method": strategy, "target": percent}, **COUNT
        )
        for percent in percents
        for strategy, title in STRATEGIES.items()
    } | {key: replace(column, where={**column.where, "target": ""}) for key, column in ENDS.items()}
    curves = metrics[(metrics["source"] == REAL_WORLD) & metrics["table"].str.startswith(TABLE)]
    parts = curves["table"].str.removeprefix(TABLE).str.split("/")
    curves = curves.assign(seen=parts.str[0], target=parts.str[1].fillna(""))
    seen = {name: encoder_title(name, "none") for name in frames["backbones"]} | {PAIR: "Measurements of the pair"}
    cell = label_cells(frames["test"], {})
    sheet = Sheet("table6_labels", {"seen": "Seen by"}, crossed(("seen", seen)), columns, curves, cell=cell)
    for percent in percents:
        sheet.compare_across([f"{strategy}_{percent}" for strategy in STRATEGIES])
    new = " or ".join(section["held_out"])
    notes = (
        f"{mean_over(sheet.seeds, frames['test'])}. Bold: the fewer labels of the two to a target.",
        f"Start: {section['initial']} labeled samples of the two known concepts. Pool: their other training "
        f"samples, of {frames['train']} with those of the new concept, and as many of the new one as make up "
        f"{100 * section['share']:g} % of it. The paper's classifier is fitted anew in each round, as in Table "
        f"III, to {section['least']} labels at least and {section['labels']} at most; '>': some runs did not reach "
        "the target. Encoders saw every concept. All labels: of a classifier that learns the whole pool.",
    )
    caption = f"Labels until a GPC to which {new} is new is as accurate on {title_of_frames(run.config)}"
    return sheet.table(caption, "quantity", notes, keep_empty=True)
