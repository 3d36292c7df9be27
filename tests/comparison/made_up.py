"""Printed numbers, and what a run collected beside them, made up for tests."""

import pandas as pd
import yaml

from gpca.comparison.published import Counterpart, Number
from gpca.comparison.verdicts import Tolerance, compare
from gpca.evaluation.measures import TIDY_COLUMNS as TIDY
from gpca.evaluation.runtime_file import RUNTIME_COLUMNS
from gpca.process.code_files import ROOT

SETTINGS = yaml.safe_load((ROOT / "config/config.yaml").read_text())["comparison"]["tolerances"]
TOLERANCES = {unit: Tolerance(**tolerance) for unit, tolerance in SETTINGS.items()}
OBJECTS = {name: {"title": name.upper(), "stand_in": False} for name in ("ycb", "linemod", "real_rgbd", "model")}
ACCURACY = Counterpart("metrics.csv", "attribution", ("ycb",), ("gpca_paper",), ("accuracy",), "all", "mean")
LABELS = Counterpart(
    "active_learning.csv", "active_learning/pretrained", ("ycb",), ("random",), ("labels_to_target",), "overlap", "mean"
)
TIME = Counterpart("runtime.csv", "components", ("model",), ("icp", "features"), ("seconds",), "CPU", "mean")


def number(value=90.0, upper=None, decimals=1, unit="%", counterpart=ACCURACY, row="YCB", note="", **more):
    return Number("I", row, "GP-CA", value, upper or value, decimals, unit, "", "Table I", counterpart, note, **more)


def tidy(values, source="ycb", method="gpca_paper", metric="accuracy", concept="all", table="attribution"):
    rows = [(table, source, method, metric, concept, seed, value) for seed, value in enumerate(values)]
    return pd.DataFrame(rows, columns=list(TIDY))


def compared(numbers, results, objects=OBJECTS, reasons=(), **more):
    return compare(numbers, results, objects, TOLERANCES, reasons, **more)


def runtime(**seconds):
    rows = [(name, "CPU", "A processor", 1, 100, mean, 0.1 * mean, mean) for name, mean in seconds.items()]
    rows += [(name, "GPU", "A GPU", 1, 100, mean / 10, 0.1 * mean, mean) for name, mean in seconds.items()]
    return pd.DataFrame(rows, columns=list(RUNTIME_COLUMNS))
