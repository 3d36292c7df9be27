"""Arrays of an earlier step with values that cannot be."""

import numpy as np
import pytest

from ...hostile import refusal
from .commands import COMMANDS


def change_arrays(path, **changes):
    with np.load(path) as archive:
        arrays = dict(archive)
    for name, change in changes.items():
        arrays[name] = change(arrays[name])
    np.savez(path, **arrays)


def at(*index, value):
    def change(array):
        array = array.astype(np.result_type(array.dtype, np.asarray(value).dtype)) if value is not None else array
        array[index] = value
        return array

    return change


def same(array):
    return np.broadcast_to(array[:1], array.shape).copy()


VALUES = {
    # What cannot be of objects
    ("objects.npz", "negative diameter", "diameter"): {"diameters_m": lambda d: -d},
    ("objects.npz", "diameter in millimetres", "diameter"): {"diameters_m": lambda d: 1e3 * d},
    ("objects.npz", "diameter of another object", "span"): {"diameters_m": at(0, value=5.0)},
    ("objects.npz", "points in millimetres", "span"): {"points_m": lambda p: 1e3 * p},
    ("objects.npz", "huge points", "points_m"): {"points_m": lambda p: p.astype(float) * 1e200},
    ("objects.npz", "one huge point", "span"): {"points_m": at(7, 0, value=1e9)},
    ("objects.npz", "all points equal", "span 0 m"): {"points_m": same},
    ("objects.npz", "complex points", "complex"): {"points_m": lambda p: p + 1j},
    ("objects.npz", "points of half precision", "float16, not float32 or float64"): {
        "points_m": lambda p: p.astype(np.float16)
    },
    ("objects.npz", "an empty name", "a name that is empty"): {"names": at(1, value="")},
    ("objects.npz", "a name of two lines", "does not fit on one line"): {"names": at(1, value="a\nb")},
    ("objects.npz", "points far from the origin", "centered"): {"points_m": lambda p: p + 5},
    ("objects.npz", "normals of no length", "normal"): {"normals": lambda n: 0 * n},
    ("objects.npz", "two of one name", "the same name"): {"names": lambda n: n[[0, 0, 2]]},
    ("objects.npz", "names of numbers", "names"): {"names": lambda n: np.arange(len(n))},
    ("objects.npz", "offsets of halves", "offsets"): {"offsets": lambda o: o + 0.0},
    ("objects.npz", "offsets that fall", "fewer than 1"): {"offsets": lambda o: o[[0, 2, 1, 3]]},
    ("objects.npz", "no objects", "has no samples"): {
        "names": lambda n: n[:0], "diameters_m": lambda d: d[:0], "offsets": lambda o: o[:1],
        "families": lambda n: n[:0], "folds": lambda n: n[:0], "points_m": lambda p: p[:0], "normals": lambda n: n[:0],
    },
    # of registrations
    ("registrations.npz", "clouds in millimetres", "'points'"): {"points": lambda p: p * 1e6},
    ("registrations.npz", "a fitness above 1", "fitness"): {"fitness": lambda f: f + 1.5},
    ("registrations.npz", "a negative RMSE", "inlier_rmse"): {"inlier_rmse": lambda r: r - 9},
    ("registrations.npz", "a mirrored pose", "T_target_source_icp"): {"T_target_source_icp": at(0, 0, value=-1.0)},
    ("registrations.npz", "a scaled pose", "T_target_source_true"): {"T_target_source_true": lambda T: 2 * T},
    ("registrations.npz", "a pose far away", "T_target_source_init"): {"T_target_source_init": at(3, 0, 3, value=1e9)},
    ("registrations.npz", "a sample twice", "sample"): {"sample": lambda s: 0 * s},
    ("registrations.npz", "a negative sample", "sample"): {"sample": at(0, value=-1)},
    ("registrations.npz", "an object before the first", "object_index"): {"object_index": at(0, value=-1)},
    ("registrations.npz", "a negative severity", "severity_noise"): {"severity_noise": lambda s: s - 1},
    # of embeddings
    ("embeddings.npz", "bytes of another order", "type >f8"): {"h": lambda h: h.astype(">f8")},
    ("embeddings.npz", "huge numbers", "above 1e+15"): {"h": lambda h: h * 1e200},
    # of outcomes
    ("uncertainty.npz", "other samples", "conditions.csv: its samples differ"): {"sample": lambda s: s + 1000},
}  # fmt: skip


@pytest.mark.parametrize("case", VALUES, ids=lambda case: f"{case[0]}: {case[1]}")
def test_values_that_cannot_be_are_refused(case, folder):
    name, _, word = case
    change_arrays(folder / name, **VALUES[case])
    line = refusal(COMMANDS[name], folder, word)
    assert ".npz" in line or ".csv" in line


@pytest.mark.parametrize("explainer", ["shap_removal", "sa_prcc_additive", "residuals_logistic"])
def test_outcomes_of_another_design_are_refused(explainer, folder):
    names = ("covariance", "uncertainty", "residual", "degenerate", "icp_calls")
    change_arrays(folder / "uncertainty.npz", **{name: lambda array: array[:, :2] for name in names})
    head, *lines = (folder / "conditions.csv").read_text().splitlines()
    kept = [line for line in lines if int(line.split(",")[2]) < 2]
    (folder / "conditions.csv").write_text("\n".join([head, *kept, ""]))
    command = [explainer if word == "shap_removal" else word for word in COMMANDS["uncertainty.npz"]]
    refusal(command, folder, "uncertainty.npz", "2 conditions are not those of design")
