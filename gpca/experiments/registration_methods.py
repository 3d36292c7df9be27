"""Registration methods on the same pairs, each from the initial pose and from that of a global method (Table XI)."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.methods import registry
from gpca.alignment.pose_error import SuccessSettings, success_within
from gpca.declarations import ByName, Experiment, Frame, LeftOut, Names, Paths, Plan, Run, Step, numbers, table
from gpca.errors import InputError, require_names, with_key
from gpca.evaluation import measures as evaluated
from gpca.evaluation.measures import ALL, SHARE, Clustered, Measure, weighted_mean
from gpca.io.csv_file import numbers as number_column
from gpca.io.csv_file import read_csv, read_numbers
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.sheet import Row, Sheet, show
from gpca.steps.registration_trials import INITIAL, NO_START, SEVERITY_COLUMNS, PairSettings

NAME = "registration_methods"
TRIAL_COLUMNS = ("add_relative", "rotation_error_rad", "translation_error", "points", *SEVERITY_COLUMNS)
RIVAL = "rival"  # the best other method at the same start, in the column `against`
BINS = ("low", "middle", "high")  # thirds of the drawn severities
# The severities of a concept: column, range in the config, factor from that to the column's unit.
DRAWN = {
    "noise": (("severity_noise", "noise", 1.0),),
    "pose": (("severity_rotation_rad", "rotation_deg", np.pi / 180), ("severity_translation", "translation", 1.0)),
    "overlap": (("severity_crop", "crop", 1.0),),
}


def check(config: dict, left_out: LeftOut) -> None:
    for name, settings in config["methods"].items():
        with_key(f"methods.{name}", registry.require_settings, name, settings or {})
    key, start = "method_pairs.global_start", config["method_pairs"]["global_start"]
    require_names(key, [start], config["methods"], "registration method", left_out("methods"))
    with_key(key, registry.require_global, start)
    if package := registry.left_out([start]).get(start):
        fault = f"'{start}' needs the package {package}, which is not installed"
        raise InputError(f"config key {key}", fault, "install it or choose another global method")


EXPERIMENT = Experiment(
    name=NAME,
    sections={"method_pairs": PairSettings, "methods": ByName},
    names=lambda config, sources: {"method": registry.installed(config["methods"])},
    check=check,
    optional_entries={"methods": Names("registration method", registry.methods)},
    lists={"method_pairs.points_of": "methods", "method_pairs.neighbors_of": "methods"},
    notices=lambda config: (
        f"registration method '{name}' is skipped: the package {package} is not installed"
        for name, package in registry.left_out(config["methods"]).items()
    ),
)


def _registered(plan: Plan) -> list[str]:
    return list(dict.fromkeys([*plan.names["method"], plan.config["method_pairs"]["global_start"]]))


REGISTER = Step(
    name="register_methods",
    run="gpca.steps.registration_trials",
    inputs={"objects": "objects/{source}.npz", "registrations": "registrations/{source}/seed{*seed}.npz"},
    outputs={
        "rows": "methods/{source}/{*method}/seed{*seed}.csv",
        "timings": "timings/{source}/method_{*method}/seed{*seed}.csv",
    },
    settings=lambda plan, wildcards: {
        "method_pairs": plan.config["method_pairs"],
        "methods": {name: plan.config["methods"][name] for name in _registered(plan)},
    },
    modules=lambda plan: map(registry.method_module, _registered(plan)),
    target="methods",
    priority=2,
)


def row_name(method: str, start: str) -> str:
    """E.g. ``gicp`` from the pair's initial pose, ``fgr+gicp`` from the pose of another method."""
    return method if start in (INITIAL, NO_START) else f"{start}+{method}"


def read_trials(path: str | Path) -> Frame:
    columns = ("sample", "object", "concept", "start", "failure", *TRIAL_COLUMNS)
    rows = read_csv(path, columns, others=("symmetric", "fitness", "inlier_rmse"))
    return rows.assign(**{name: number_column(path, rows, name) for name in TRIAL_COLUMNS})


def trials(files: Paths, objects: Paths) -> Frame:
    """Rows of all files; the method is named with its start, and the cluster is the object's family in its source."""
    families = {}
    for path in objects:
        clouds = ObjectClouds.load(path)
        families[Path(path).stem] = dict(zip(clouds.names.tolist(), clouds.families.tolist(), strict=True))

    def read(path: Path) -> Frame:
        rows, (source, method, _) = read_trials(path), evaluated.source_method_seed(path)
        family_N = rows["object"].map(families.get(source, {}))
        if family_N.isna().any():
            fault = f"object '{rows['object'][family_N.isna()].iloc[0]}' is none of objects/{source}.npz"
            raise InputError(path, fault, "regenerate both from the same config")
        return rows.assign(row=[row_name(method, start) for start in rows["start"]], cluster=f"{source}/" + family_N)

    rows = evaluated.read_samples(files, read)
    return rows.assign(table=NAME, method=rows["row"])


def parts(rows: Frame, severities: Mapping[str, Iterable[float]]) -> evaluated.Parts:
    """Masks of all rows, of each cause, and of each third of its severities."""
    masks = {ALL: np.ones(len(rows), bool)}
    for concept in CONCEPTS:
        masks[concept] = mask_N = (rows["concept"] == concept).to_numpy()
        bin_N = np.minimum(3 * share_of_milder(rows, concept, severities), len(BINS) - 1).astype(int)
        masks |= {f"{concept}_{name}": mask_N & (bin_N == i) for i, name in enumerate(BINS)}
    return masks


def share_of_milder(rows: Frame, concept: str, severities: Mapping[str, Iterable[float]]) -> np.ndarray:
    """Share of a cause's drawn severities that is milder than each row's, in [0, 1].

    A pose error has two severities, each uniform in its range; it is as severe as the mean of their quantiles.
    """
    quantiles = []
    for column, name, factor in DRAWN[concept]:
        low, high = severities[name]
        width = max(high - low, 1e-12)  # a range may be a single value
        quantiles.append(np.clip((rows[column].to_numpy() / factor - low) / width, 0, 1))
    mean_S = np.mean(quantiles, axis=0)
    if len(quantiles) == 1:
        return mean_S
    return np.where(mean_S < 0.5, 2 * mean_S**2, 1 - 2 * (1 - mean_S) ** 2)  # distribution of the mean of two uniforms


def measures(success: SuccessSettings) -> dict[str, Measure]:
    def within(limit: float, *only: str) -> Measure:
        return Measure(lambda rows: (rows["failure"] == "") & (rows["add_relative"] < limit), only=only)

    return {
        "success": within(success.error),
        "failed": Measure(lambda rows: rows["failure"] != ""),
        "add": Measure("add_relative", (0, inf)),
        "rotation_deg": Measure("rotation_error_rad", (0, 180), factor=180 / np.pi),
        "translation": Measure("translation_error", (0, inf)),
        "test_samples": evaluated.COUNT,
        **{success_within(limit): within(limit, ALL) for limit in success.curve},
        "points": Measure("points", (0, inf), only=(ALL,)),
    }


@numbers(
    "registration_methods.csv",
    "registration_intervals.csv",
    files="methods/{source}/{method}/seed{seed}.csv",
    objects="objects/{source}.npz",
)
def collect(run: Run, files: Paths, objects: Paths) -> tuple[Frame, Frame]:
    """Measures by seed, and over all sources and seeds with intervals over families of objects."""
    severities = dict(run.config["registrations"]["severities"])
    success = SuccessSettings(**run.config["success"])
    rows, measured = trials(files, objects), measures(success)
    by_cause = {"success": measured["success"]}
    order = ("failed", *map(success_within, success.curve), "add", "rotation_deg", "translation")
    by_cause |= {name: replace(measured[name], only=(ALL,)) for name in order}
    draws = Clustered.drawn(rows["seed"], rows["cluster"], "registration intervals")
    masks, pooled = partial(parts, severities=severities), rows.assign(source=evaluated.POOLED)
    intervals = evaluated.over_seeds(pooled, masks, by_cause, draws)
    return evaluated.per_seed(rows, masks, measured), with_leads(intervals, rows, measured["success"])


def with_leads(intervals: Frame, rows: Frame, success: Measure) -> Frame:
    """Intervals, and by how much each method succeeds more often than the best other one at its start, by cause."""
    import pandas as pd

    records: list[tuple] = []
    pair = ["source", "seed", "sample"]
    for _, trials in rows.assign(right=success.of).groupby("start", sort=False):
        wide = trials.pivot(index=pair, columns="method", values="right").dropna()  # pairs that all have registered
        same = trials.drop_duplicates(pair).set_index(pair, drop=False).loc[wide.index]
        draws = Clustered.drawn(same["seed"], same["cluster"], "registration intervals")
        for part, mask_N in evaluated.by_value(same, "concept", CONCEPTS).items():
            drawn = draws.subset(mask_N)
            values = {name: weighted_mean(wide[name][mask_N].to_numpy(float), drawn.weights) for name in wide}
            records += evaluated.compared(
                (NAME, evaluated.POOLED), "success", part, values, drawn, SHARE, {RIVAL: lambda _, names: names}
            )
    frame = evaluated.tidy(records, "registrations", (*evaluated.KEYS, *evaluated.AGAINST, *evaluated.NUMBERS))
    return pd.concat([intervals.assign(against="", other=""), frame[frame["against"] != ""]])[list(frame.columns)]


def read_seconds(files: Paths) -> Frame:
    """Mean seconds by seed, apart from the other measures, because they differ from run to run."""
    columns = ("sample", "start", "seconds")
    rows = evaluated.read_samples(files, lambda path: read_numbers(path, columns, ("seconds",)))
    named = [row_name(row.method.removeprefix("method_"), row.start) for row in rows.itertuples()]
    return mean_seconds(rows.assign(table=NAME, method=named))


def mean_seconds(rows: Frame) -> Frame:
    whole = partial(evaluated.by_value, column="", values=())
    return evaluated.per_seed(rows, whole, {"seconds": Measure("seconds", (0, inf))})


SECTION = "Beyond the paper: registration methods"
HEADS = {"start": "Start", "method": "Method"}
INTERVALS = {"intervals": "registration_intervals.csv"}
CAUSES = {f"success_{cause}": show("success", f"{cause.capitalize()} (%)", cause) for cause in (ALL, *CONCEPTS)}
ERRORS = {
    "failed": show("failed", "Failed (%)", interval=False, least_is_best=True),
    "add": show("add", "ADD(-S) (% d)", limits=(0, inf), least_is_best=True),
    "rotation_deg": show("rotation_deg", "Rotation (°)", factor=1, limits=(0, 180), least_is_best=True),
    "translation": show("translation", "Translation (% d)", limits=(0, inf), least_is_best=True),
}
LEAD: dict[str, Any] = {"where": {"against": RIVAL}, "limits": (-100.0, 100.0)}
NO_INTERVAL: dict[str, Any] = {"interval": False, "limits": (0, inf)}
SEVERITIES = {
    f"{cause}_{name}": show("success", f"{cause.capitalize()}, {name} (%)", f"{cause}_{name}", decimals=0)
    for cause, name in product(CONCEPTS, BINS)
} | {
    f"lead_{cause}": show("success", f"{cause.capitalize()}, lead (points)", cause, decimals=0, **LEAD)
    for cause in CONCEPTS
}
COSTS = {
    "points": show("points", "Points", factor=1, frame="metrics", decimals=0, **NO_INTERVAL),
    "milliseconds": show("seconds", "ms", factor=1e3, frame="seconds", least_is_best=True, **NO_INTERVAL),
}


@table(
    SECTION,
    "Table XI: registration methods",
    """How often each method registers the same pairs correctly, how far it is off and how long it takes. Compare only
    rows of one start: from the pair's own, a local method can only lose the true pose of noise and overlap, while a
    global method has to find it.""",
    **INTERVALS,
    metrics="registration_methods.csv",
    seconds=(read_seconds, "timings/{source}/method_{method}/seed{seed}.csv"),
)
def table11_registration(run: Run, intervals, metrics, seconds):
    by_seed = {"metrics": metrics, "seconds": seconds}
    columns = CAUSES | {"lead": show("success", "Lead (points)", **LEAD)} | ERRORS | COSTS | SEVERITIES
    for limit in run.config["success"]["curve"]:
        columns[success_within(limit)] = show(success_within(limit), f"Off by less than {100 * limit:g} % d (%)")
    rows = method_rows(run.config["methods"], run.config["method_pairs"]["global_start"])
    sheet = Sheet("table11_registration", HEADS, rows, columns, intervals, by_seed, list(run.sources))
    pairs = int(intervals.loc[intervals["concept"] == ALL, "samples"].max())
    notes = (
        f"{sheet.over(pairs // sheet.seeds)}. A success is off by less than the config's `success.error` of the "
        "diameter d, ADD or, for symmetric objects, ADD-S. A registration that failed by the method's own account is "
        "no success. Bold: best of a start.",
        *missing_methods(run.config["methods"]),
        "Lead: how many more succeed than by the best other method of the same start, pair by pair. "
        "Errors are means over all registrations, at the last pose of those that failed; rotations up to the object's "
        "symmetries. Failed: given up by the method itself, or not at rest. Points: of a cloud, on average. ms: of one "
        "registration, with its global start if it has one, without the normals; it differs from run to run. Low, "
        "middle, high: thirds of what is drawn, a pose error by the mean of its places in the two ranges.",
    )
    caption = "Registrations that succeed, and how far all are off" + run.stand_ins()
    return sheet.table(caption, "metric", notes, bold=CAUSES | ERRORS, same=1)


def method_rows(names: Iterable[str], global_start: str, initial: str = "Initial pose") -> Iterable[Row]:
    """Rows start by start: local methods have one at each start, global methods none."""
    entries = {name: registry.method_entry(name) for name in registry.installed(names)}
    starts = {INITIAL: initial, NO_START: "None"}
    if global_start in entries:
        starts[global_start] = entries[global_start].title
    for start, (name, entry) in product(starts.items(), entries.items()):
        if entry.is_global == (start[0] == NO_START):
            yield Row([start, (name, entry.title)], {"method": row_name(name, start[0])})


def missing_methods(names: Iterable[str]) -> list[str]:
    """Footnote on methods whose package is not installed, if there are any."""
    absent = registry.left_out(names).items()
    needs = ", ".join(f"{registry.method_entry(name).title} needs the package {package}" for name, package in absent)
    return [f"Left out, as the package is not installed: {needs}."] if needs else []
