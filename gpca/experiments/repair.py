"""Repair: another pose in the place of a wrong one, and rivals that register again (Table XX)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.methods.registry import installed, method_entry, method_module
from gpca.declarations import Experiment, Frame, Paths, Run, Step, numbers, table
from gpca.evaluation.intervals import Clustered, weighted_mean
from gpca.evaluation.measures import ALL, SHARE, Rivals, by_value, compared, intervals, read_samples
from gpca.experiments import registration_methods
from gpca.experiments.registration_methods import missing_methods
from gpca.experiments.scan_causes import reenactment_settings
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.acceptance import accepted_in_hindsight
from gpca.io.csv_file import ANY, read_csv, read_numbers
from gpca.io.csv_file import numbers as number_column
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Row, Sheet, crossed, show
from gpca.settings import Distinct
from gpca.steps.repair import LIKELIEST, MANY_STARTS, REPAIR, STARTS, Asked
from gpca.steps.repair_verdicts import CAUSES, COLUMNS, HARD, JUDGED, NAMED, SCORE

NAME = "repair"
FRAMES, SCANS = "frames", "scans"
TRACKS = {CAUSES: "Causes", HARD: "Hard", FRAMES: "Depth frames", SCANS: "Scans"}
POINTS = {"few": (0, 256), "some": (256, 512), "many": (512, inf)}  # of the smaller cloud: above, and at most
THIRDS = ("near", "middle", "far")  # of the failed registrations, by the error of their start
RIVAL = "rival"
COMPARED = ("repaired", "right_pose")  # shares of which there are differences from the best rival
OF_REPAIR = ("several", "called", "false_alarms")  # the same for all methods, or of repair alone
BUILT_IN = {
    REPAIR: "Repair",
    LIKELIEST: "Likeliest hypothesis",
    STARTS: "Best of the 13 starts",
    MANY_STARTS: "ICP from as many starts as the search",
}


@dataclass(frozen=True, kw_only=True)
class Section(Asked):
    """The registrations that are asked about, and the registration methods that are rivals."""

    methods: Distinct[str]


EXPERIMENT = Experiment(
    name=NAME,
    sections={NAME: Section},
    names=lambda config, _sources: {"repair_method": installed(config[NAME]["methods"])},
    lists={"repair.methods": "methods"},
)


def own_settings(
    config: Mapping[str, Any], causes: Mapping | None = None, reenactment: Mapping | None = None
) -> dict[str, Any]:
    """Settings of the attempts, given what differs from `causes`, and from the re-enactments of objects."""
    methods = {name: config["methods"][name] or {} for name in installed(config[NAME]["methods"])}
    return {
        "repair": config[NAME] | {"methods": methods},
        "causes": config["causes"] | (causes or {}),
        "reenactment": reenactment or config["diagnosis"]["reenactment"],
        "icp": config["registrations"]["icp"],
    }


def _outputs(track: str, source: str = "{source}") -> dict[str, str]:
    return {
        "attempts": f"repairs/{track}/{source}/seed{{seed}}.npz",
        "timings": f"timings/{source}/repair_{track}/seed{{seed}}.csv",
    }


ATTEMPT = Step(
    name="attempt_repairs",
    run="gpca.steps.repair:attempt",
    inputs={"objects": "objects/{source}.npz", "causes": "causes/{source}/seed{seed}.npz"},
    outputs=_outputs(CAUSES),
    settings=lambda plan, _wildcards: own_settings(plan.config),
    modules=lambda plan: map(method_module, plan.names["repair_method"]),
    priority=3,
)
ATTEMPT_HARD = replace(
    ATTEMPT,
    name="attempt_hard_repairs",
    inputs={"objects": "objects/{source}.npz", "causes": "hard/{source}/seed{seed}.npz"},
    outputs=_outputs(HARD),
    settings=lambda plan, _wildcards: own_settings(plan.config, causes=plan.config["controls"]["hard"]),
    where={"seed": "control_seed"},
)
ATTEMPT_FRAMES = replace(
    ATTEMPT,
    name="attempt_frame_repairs",
    inputs={
        "objects": "objects/{frames}.npz",
        "causes": "frame_causes/seed{seed}.npz",
        "samples": "frame_causes/seed{seed}.csv",
        "reenactments": "reenactments/{frames}/seed{seed}.npz",
    },
    outputs=_outputs(FRAMES, "{frames}"),
    params={"source": REAL_WORLD},
    where={"seed": "frame_cause_seed"},
)
ATTEMPT_SCANS = replace(
    ATTEMPT,
    name="attempt_scan_repairs",
    inputs={
        "causes": "scan_causes/{source}/seed{seed}.npz",
        "samples": "scan_causes/{source}/seed{seed}.csv",
        "reenactments": "scan_reenactments/{source}/seed{seed}.npz",
    },
    outputs=_outputs(SCANS),
    settings=lambda plan, _wildcards: own_settings(plan.config, reenactment=reenactment_settings(plan.config)),
    where={"source": "scan_set", "seed": "scan_seed"},
)
DECIDE = Step(
    name="repair_verdicts",
    run="gpca.steps.repair_verdicts",
    inputs={
        "attempts": [
            f"repairs/{CAUSES}/{{*source}}/seed{{*seed}}.npz",
            f"repairs/{HARD}/{{*hard_source}}/seed{{*control_seed}}.npz",
            f"repairs/{FRAMES}/{{frames}}/seed{{*frame_cause_seed}}.npz",
            f"repairs/{SCANS}/{{*scan_set}}/seed{{*scan_seed}}.npz",
        ]
    },
    outputs={"verdicts": "repairs/verdicts.csv"},
    settings=lambda plan, _wildcards: {"tolerance": plan.config["success"]["error"]},
)


def read_verdicts(path: str | Path) -> Frame:
    rows = read_csv(path, (*NAMED, *COLUMNS, SCORE), others=ANY)
    numeric = {name: number_column(path, rows, name) for name in ("seed", "sample", "points", "start_error", SCORE)}
    return rows.assign(**numeric, **{name: rows[name].astype(str) == "True" for name in COLUMNS})


def parts_of(rows: Frame) -> Iterator[tuple[str, np.ndarray]]:
    """Parts of registrations: all, by dominant cause, number of points, error of the start, source and its kind."""
    yield from by_value(rows, "label", CONCEPTS).items()
    for name, (least, most) in POINTS.items():
        yield name, rows["points"].between(least, most, inclusive="right").to_numpy()
    if rows["failed"].any():
        edges = np.quantile(rows["start_error"][rows["failed"]], [1 / 3, 2 / 3])
        third_N = np.searchsorted(edges, rows["start_error"])
        yield from ((name, third_N == third) for third, name in enumerate(THIRDS))
    for column in ("source", "group"):
        values = rows[column].unique()
        yield from ((value, (rows[column] == value).to_numpy()) for value in values if len(values) > 1)


AGAINST: Mapping[str, Rivals] = {  # of repair: methods with tests of their own
    RIVAL: lambda name, names: [each for each in names if name == REPAIR and not each.endswith(f"_{JUDGED}")]
}


def hindsight(rows: Frame, part_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    """Share (B,) of the failed registrations of a part that are repaired with the best limit in hindsight."""
    mask_N = part_N & rows["called"].to_numpy()
    right_n, failed_n = (rows[name].to_numpy()[mask_N] for name in ("right_pose", "failed"))
    weights_B_n = weights_B_N[:, mask_N]
    accepted_B_n = accepted_in_hindsight(rows[SCORE].to_numpy(float)[mask_N], ~right_n, weights_B_n)
    with np.errstate(invalid="ignore"):
        repaired_B = (weights_B_n * accepted_B_n * (right_n & failed_n)).sum(axis=1)
        return repaired_B / weights_B_N[:, part_N & rows["failed"].to_numpy()].sum(axis=1)


@numbers("repair.csv", rule="repair_metrics", verdicts="repairs/verdicts.csv")
def collect(run: Run, verdicts: str | Path) -> Frame:
    """Measures with intervals of every track (``source``), method and part of its registrations (``concept``).

    Differences are from the rival with a test of its own that has the most.
    """
    return measured(read_verdicts(verdicts))


def measured(verdicts: Frame) -> Frame:
    records: list[tuple] = []
    for track, rows in verdicts.groupby("track", sort=False):
        by_method = {str(name): subset.reset_index(drop=True) for name, subset in rows.groupby("method", sort=False)}
        asked, keys = by_method[REPAIR], (NAME, str(track))
        draws = Clustered.drawn(asked["seed"], asked["source"] + "/" + asked["cluster"], "repair intervals", track)
        is_failed_N, called_N = asked["failed"].to_numpy(), asked["called"].to_numpy()
        for part, part_N in parts_of(asked):
            failed_N, good_N = part_N & is_failed_N, part_N & ~is_failed_N
            shares = {
                "repaired": (failed_N, lambda each: each["replaced"] & each["right"]),
                "right_pose": (failed_N, lambda each: each["right_pose"]),
                "several": (failed_N, lambda each: each["several"]),
                "called": (failed_N, lambda each: each["called"]),
                "false_alarms": (good_N, lambda each: each["called"]),
                "harmed": (good_N, lambda each: each["replaced"] & ~each["right"]),
            }
            for metric, (mask_N, share) in shares.items():
                if mask_N.any():
                    drawn, named = draws.subset(mask_N), [REPAIR] if metric in OF_REPAIR else by_method
                    values = {name: weighted_mean(share(by_method[name])[mask_N], drawn.weights) for name in named}
                    against = AGAINST if metric in COMPARED else None
                    records += compared(keys, metric, part, values, drawn, SHARE, against)
            if failed_N.any():
                values = {name: hindsight(each, part_N, draws.weights) for name, each in by_method.items()}
                records += compared(keys, "hindsight", part, values, draws.subset(failed_N), SHARE, AGAINST)
            for name, each in by_method.items():
                if (mask_N := part_N & called_N & each["replaced"].to_numpy()).any():
                    drawn = draws.subset(mask_N)
                    values = {name: weighted_mean(~each["right"][mask_N], drawn.weights)}
                    records += compared(keys, "wrong", part, values, drawn, SHARE)
    return intervals(records, "repairs")


def read_seconds(files: Paths) -> Frame:
    """Mean seconds of each method by seed, over all sources of objects; they differ from run to run."""
    columns = ("sample", "method", "seconds")
    return mean_seconds(read_samples(files, lambda path: read_numbers(path, columns, ("seconds",)), ("source",)))


def mean_seconds(rows: Frame) -> Frame:
    return registration_methods.mean_seconds(rows.assign(table=NAME, source=CAUSES))


SECTION = "Beyond the paper: registration methods"
LEAD: dict[str, Any] = {"where": {"against": RIVAL}, "limits": (-100.0, 100.0)}
SHOWN = {
    "repaired": show("repaired", "Repaired (%)"),
    "hindsight": show("hindsight", "Best limit in hindsight (%)"),
    "lead": show("hindsight", "Minus best rival, both in hindsight (points)", **LEAD),
    "wrong": show("wrong", "Wrong of the replaced (%)", least_is_best=True),
    "harmed": show("harmed", "Harmed (%)", least_is_best=True),
    "right_pose": show("right_pose", "Right pose (%)"),
    "several": show("several", "Several (%)", interval=False),
}
SECONDS = show("seconds", "ms", factor=1e3, frame="seconds", interval=False, limits=(0, inf), least_is_best=True)


def titles_of(config: Mapping[str, Any]) -> dict[str, str]:
    """Titles of the rows by name: repair, and rivals by their best tests and by the judge."""
    titles = BUILT_IN | {name: method_entry(name).title for name in installed(config[NAME]["methods"])}
    return titles | {f"{name}_{JUDGED}": f"{title}, by the judge" for name, title in titles.items() if name != REPAIR}


def repair_sheet(titles: Mapping[str, str], intervals: Frame, seconds: Frame) -> Sheet:
    """Rows of all tracks and methods; the seconds are those of objects."""
    heads, rows = {"track": "Registrations", "method": "Method"}, crossed(("source", TRACKS), ("method", titles))
    return Sheet("table20_repair", heads, rows, SHOWN | {"ms": SECONDS}, intervals, {"seconds": seconds})


@table(
    SECTION,
    "Table XX: repair",
    """Failed registrations that are given a right pose by whoever says that its pose is right, and good ones that
    are made worse. A registration that is called failed is registered again by each method; its own best test, or the
    judge, says whether the new pose takes the place of the old one, at a limit that is calibrated to at most 5 % of
    wrong poses on other families of objects.""",
    intervals="repair.csv",
    seconds=(read_seconds, f"timings/{{source}}/repair_{CAUSES}/seed{{seed}}.csv"),
)
def table20_repair(run: Run, intervals, seconds):
    sheet = repair_sheet(titles_of(run.config), intervals, seconds)
    row_of_track = {row.where["source"]: i for i, row in enumerate(sheet.rows) if row.where["method"] == REPAIR}
    counts = {TRACKS[track]: sheet.samples("repaired", row=i) for track, i in row_of_track.items()}
    return sheet.table(
        "Failed registrations that are repaired, and good ones that are harmed" + run.stand_ins(),
        "metric",
        (
            f"{sheet.over()}. Failed registrations: {', '.join(f'{title} {n}' for title, n in counts.items())}.",
            "Best limit in hindsight: repaired with the largest limit at which at most 5 % of these poses are wrong, "
            "which nobody knows beforehand; it compares methods where few registrations allow no promise.",
            "Repaired, right pose and several: of the failed; harmed: of the good. Wrong: of those whose pose is "
            "replaced. Right pose: accepted or not. Several: poses are given together of which one is right. ms: of "
            "objects, on one core, with tests and refinement; it differs from run to run.",
            "On depth frames and scans, limits come from objects, and nothing is promised.",
            *missing_methods(run.config[NAME]["methods"]),
        ),
        bold=["repaired", "hindsight", "wrong", "harmed", "right_pose"],
        same=1,
    )


@table(
    SECTION,
    "Table XX, lead by part",
    """By how much repair is ahead of the rival that repairs most of a part, both with the best limit in hindsight.""",
    intervals="repair.csv",
)
def table20_lead(run: Run, intervals):
    titles = {name: name.capitalize() for name in (ALL, *CONCEPTS)}
    titles |= {"few": "Up to 256 points", "some": "Up to 512", "many": "More"}
    titles |= {"near": "Start near", "middle": "Middle", "far": "Far"} | run.source_titles
    rows = [Row([part], {"source": CAUSES, "method": REPAIR, "concept": part[0]}) for part in titles.items()]
    columns = {  # of any part
        name: replace(SHOWN[name], where={key: value for key, value in SHOWN[name].where.items() if key != "concept"})
        for name in ("repaired", "hindsight", "lead", "right_pose")
    }
    sheet = Sheet("table20_lead", {"part": "Failed registrations"}, rows, columns, intervals)
    notes = (
        f"{sheet.over()}. Near, middle and far: thirds of the failed registrations, by the error of their start. The "
        "best rival is picked for each part.",
    )
    return sheet.table("Lead of repair over the best rival, by part" + run.stand_ins(), "metric", notes)
