"""Policies of recovery from failed registrations, in a closed loop on tables of a virtual camera (Table VIII)."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from typing import Annotated, Any, Literal

from pydantic import Field

from gpca.causes.policy import Thresholds
from gpca.declarations import Experiment, Frame, LeftOut, Names, Paths, Plan, Run, Step, table
from gpca.encoders.registry import EncoderChanges
from gpca.errors import InputError, require_names, with_key
from gpca.evaluation.measures import ALL
from gpca.experiments.recovery_measures import ERROR, SEQUENCE
from gpca.explainers.registry import explainer_entry, explainer_module, require_settings
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import SituationSettings
from gpca.io.csv_file import read_numbers
from gpca.objects.camera import Camera
from gpca.objects.entry import SurfacePoints
from gpca.objects.source import data_files, data_folders, source_modules
from gpca.pairs.perturbation import CONCEPTS, Hidden
from gpca.pairs.synthesis import TestSamples, TrainSamples
from gpca.recovery.actions import ACTIONS, action_of
from gpca.recovery.policies import PolicyEntry, named_policies, policies, policy_entry, policy_module
from gpca.recovery.settings import LoopSettings
from gpca.reporting.sheet import Row, Sheet, Table, over_clusters, plain_cell, plural, show, where
from gpca.settings import Bounds, Count, Distinct, Keys, NotNegative, OpenShare, Share, changes_of, part_of, required

SECTION = "V Robotic deployment for action recovery"
DECLARED = ("uncertain", "dominant", "improvement")  # thresholds of the config; null leaves one to the calibration
AGAINST = {SEQUENCE: "best sequence", ERROR: "error only"}
SECONDS = ("explanation_seconds", "action_seconds")


@dataclass(frozen=True)
class DeclaredThresholds:
    """When a policy takes which branch; without `uncertain` the calibration samples set it, by `queued_share`."""

    uncertain: NotNegative | None
    queued_share: Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)]
    dominant: Share
    improvement: Share


@dataclass(frozen=True)
class Estimator(InitialPoseSettings):
    """The settings of the robot's pose estimate."""

    form: Literal["global_registration"] = "global_registration"


@dataclass(frozen=True)
class Section:
    """Recovery from failed registrations, in a closed loop on tables of the virtual camera."""

    objects: str
    policies: Distinct[str]
    treatments: Annotated[dict, Keys(dict.fromkeys(CONCEPTS, str), required=CONCEPTS)]
    actions: Annotated[dict[str, dict | None], Field(min_length=1)]  # an action checks its settings itself
    costs: dict[str, Share]
    needless: Share
    thresholds: DeclaredThresholds
    gate: Annotated[dict, required(false_alarms=OpenShare)]  # share of the good that gated policies act on
    rehearsals: Count
    loop: Annotated[dict, part_of(LoopSettings, without=("success", "cloud_points", "icp"))]
    train: TrainSamples
    calibration: TestSamples
    remedied: TestSamples
    tables: Count
    camera: Camera
    noise_scale: tuple[NotNegative, NotNegative]
    hidden: tuple[Hidden, Hidden]
    estimator: Annotated[dict, changes_of(Estimator, without=("rotation_deg", "translation"))]
    model_points: SurfacePoints
    encoder: EncoderChanges


def check(config: dict, left_out: LeftOut) -> None:
    section = config["recovery"]
    require_names("recovery.objects", [section["objects"]], config["sources"], "source", left_out("sources"))
    for name, settings in section["actions"].items():
        with_key(f"recovery.actions.{name}", action_of, name, settings or {})
    require_names("recovery.costs", list(section["costs"]), ACTIONS, "action")
    for action in section["actions"]:
        if action not in section["costs"]:
            raise InputError("config key recovery.costs", f"lacks the action '{action}'", "give every action a cost")
    for concept, action in section["treatments"].items():
        key = f"recovery.treatments.{concept}"
        require_names(key, [action], section["actions"], "action", left_out("recovery.actions"))
    if len(set(section["treatments"].values())) < len(section["treatments"]):
        fault = "one action treats two concepts"
        raise InputError("config key recovery.treatments", fault, "give each concept its own")
    for name in section["policies"]:
        if explainer := with_key("recovery.policies", policy_entry, name, tuple(section["actions"])).explainer:
            settings = config["explainers"].get(explainer) or {}
            with_key(f"explainers.{explainer}", require_settings, explainer, settings)
            if design := explainer_entry(explainer).design:
                key = f"recovery.policies.{name}"
                require_names(key, [design], config["uncertainty"], "uncertainty", left_out("uncertainty"))
    thresholds = {name: section["thresholds"][name] for name in DECLARED}
    given = {name: value for name, value in thresholds.items() if value is not None}
    with_key("recovery.thresholds", lambda: Thresholds(**given))
    ranges: dict[str, Any] = {name: tuple(section[name]) for name in ("noise_scale", "hidden")}
    with_key("recovery", lambda: SituationSettings(**ranges))


def policies_without(left_out: LeftOut) -> set[str]:
    """Policies that go with the actions and the uncertainty that the config leaves out."""
    reading = {name: entry.explainer for name, entry in named_policies().items() if entry.explainer}
    actions = [action for action in ACTIONS if action not in left_out("recovery.actions")]
    gone = {name for name, each in reading.items() if explainer_entry(each).design in left_out("uncertainty")}
    return gone | (policies(tuple(ACTIONS)).keys() - policies(actions).keys())


def _entries(config: Mapping[str, Any]) -> dict[str, PolicyEntry]:
    actions = tuple(config["recovery"]["actions"])
    return {name: policy_entry(name, actions) for name in config["recovery"]["policies"]}


def policy_titles(config: Mapping[str, Any]) -> dict[str, str]:
    return {name: entry.title for name, entry in _entries(config).items()}


EXPERIMENT = Experiment(
    name="recovery",
    beside=("recovery_measures", "recovery_example"),
    sections={"recovery": Section},
    check=check,
    optional_entries={"recovery.actions": Names("action", lambda: ACTIONS)},
    switches={"recovery.policies": Names("policy", lambda: policies(tuple(ACTIONS)))},
    lists={"recovery.policies": policies_without},
)


def explained(plan: Plan) -> list[str]:
    return sorted({entry.explainer for entry in _entries(plan.config).values() if entry.explainer})


def standing(plan: Plan) -> dict[str, Any]:
    return dict(plan.sources[plan.config["recovery"]["objects"]])


RECOVER = Step(
    name="recover",
    run="gpca.steps.recovery",
    data=lambda plan, _wildcards: data_files(standing(plan)),
    outputs={
        "rows": "recovery/seed{seed}.csv",
        "policy": "recovery/policy_seed{seed}.json",
        "example": "recovery/example_seed{seed}.npz",
        "timings": "timings/recovery/seed{seed}.csv",
    },
    settings=lambda plan, _wildcards: {
        **{name: plan.config[name] for name in ("recovery", "success", "registrations")},
        "objects": plan.config["sources"][plan.config["recovery"]["objects"]],
        "scenes": plan.config["real_world"]["scenes"],
        "encoder": plan.encoder | plan.config["recovery"]["encoder"],
        "uncertainty": plan.config["uncertainty"].get("removal", {}),
        "reenactment": plan.config["diagnosis"]["reenactment"],
        "explainers": {name: plan.config["explainers"].get(name) or {} for name in explained(plan)},
    },
    params={"folders": lambda plan, _: data_folders(standing(plan), plan.config["data_dir"], plan.config["downloads"])},
    modules=lambda plan: [
        plan.encoder_module,
        *map(explainer_module, explained(plan)),
        *(policy_module(name) for name in plan.config["recovery"]["policies"] if name in named_policies()),
        *source_modules(standing(plan)),
    ],
    priority=6,
)


def mean_seconds(files: Paths) -> dict[str, float]:
    """Policy -> mean seconds of a failure, of explaining and acting, over all files of seconds."""
    import pandas as pd

    parts = []
    for path in files:
        rows = read_numbers(path, ("episode", "failed", "policy", *SECONDS), SECONDS, others=("step",))
        rows = rows[rows["failed"] == "True"].set_index(["policy", "episode"])
        parts.append(sum(rows[name] for name in SECONDS).groupby(level=[0, 1]).sum())
    return pd.concat(parts).groupby(level="policy").mean().to_dict()


@table(
    SECTION,
    "Table VIII: recovery by policy",
    """The share of failed registrations that each policy repairs with the same number of actions, and the share of good
    ones that it acts on: GP-CA's policies against fixed sequences of actions, one that knows only that the pose is
    wrong, random ones and the oracle. The objects are on rendered tables. The paper shows recovery only in a video.""",
    after="fig6_mitigation",
    metrics="recovery.csv",
    intervals="recovery_intervals.csv",
    differences="recovery_differences.csv",
    seconds=(mean_seconds, "timings/recovery/seed{seed}.csv"),
)
def table8_recovery(
    run: Run, metrics: Frame, intervals: Frame, differences: Frame, seconds: Mapping[str, float]
) -> Table:
    import pandas as pd

    budget, seeds = run.config["recovery"]["loop"]["budget"], metrics["seed"].nunique()
    within = {f"recovered_within_{k}": show(f"recovered_within_{k}", f"Within {k} (%)") for k in range(1, budget + 1)}
    first, last = "recovered_within_1", f"recovered_within_{budget}"
    plain: dict[str, Any] = {"decimals": 0, "interval": False}
    apart: dict[str, Any] = {"interval": False, "limits": (0, inf)}
    columns = {
        **within,
        "acted_nominal": show("acted_nominal", "Acts on good (%)", decimals=0, least_is_best=True),
        **{
            f"{metric}_{kind}": show(metric, f"{k}: to {words} (points)", where={"against": kind}, limits=(-100, 100))
            for kind, words in AGAINST.items()
            for k, metric in ((1, first), (budget, last))
        },
        **{f"{last}_{cause}": show(last, f"{cause.capitalize()} (%)", cause, **plain) for cause in CONCEPTS},
        "queued": show("queued", "Queued (%)", **plain),
        "left_alone": show("left_alone", "Taken for good (%)", least_is_best=True, **plain),
        "cost": show("cost", "Cost", decimals=3, **apart),
        "seconds": show("seconds", "Seconds", decimals=2, **apart),
    }
    rows = [Row([(name, title)], {"method": name}) for name, title in policy_titles(run.config).items()]
    sheet = Sheet("table8_recovery", {"policy": "Policy"}, rows, columns, pd.concat([intervals, differences]))
    of_all = where(metrics, {"concept": ALL}).pivot_table(index=["method", "seed"], columns="metric", values="value")
    costs = (of_all["cost"] * of_all["episodes"]).groupby("method").sum() / of_all["episodes"].groupby("method").sum()
    for i, row in enumerate(sheet.rows):
        name = row.where["method"]
        for key, value in {"cost": costs.get(name), "seconds": seconds.get(name)}.items():
            if value is not None:
                sheet.cells[i, key] = plain_cell(value, seeds, sheet.cells[i, first].test_samples)
    failures = sheet.cells[0, first].test_samples
    good = max((cell.test_samples for (_, key), cell in sheet.cells.items() if key == "acted_nominal"), default=0)
    notes = (
        f"{failures} failures over {plural(seeds, 'seed')}: {failure_counts(metrics)}. A failure is a pose off by "
        f"{100 * run.config['success']['error']:g} % of the diameter or more (ADD; ADD-S for symmetric objects) that "
        f"is not off without its cause. {over_clusters(seeds, clusters='rendered tables')}. Bold: best of a column.",
        f"Acts on good: of {good} registrations on the same tables whose pose is right, those that the policy "
        "would change. Policies that know that a pose is wrong change all; the oracle knows of these too.",
        f"To best sequence, to error only: paired differences of the shares within 1 and within {budget} actions. The "
        "best sequence is the fixed one that does best on these very failures. Error only is the order that was best "
        "on the rehearsals, gated for policies that recognize failures themselves.",
        f"Noise, Pose, Overlap: by cause, within {budget} actions. Queued: left to a person instead. Taken for "
        "good: failures that the policy leaves as they are. Cost: of all actions on a failure; a repaired pose is "
        "worth 1. Seconds: of explaining, acting and registering, without the camera's and the robot's own times.",
    )
    return sheet.table(f"Failed registrations recovered (%): {tables_title(run)}", "metric", notes, bold=within)


def tables_title(run: Run) -> str:
    return f"Tables of the virtual camera, {run.source_titles[run.config['recovery']['objects']]}"


def failure_counts(metrics: Frame) -> str:
    """How many failures of how many registrations there are by cause, in words."""
    rows = metrics[metrics["method"] == metrics["method"].iloc[0]]
    sums = rows.groupby(["concept", "metric"])["value"].sum()
    return ", ".join(
        f"{sums.get((cause, 'episodes'), 0):.0f} by {cause} among {sums.get((cause, 'tries'), 0):.0f} registrations"
        for cause in CONCEPTS
    )
