"""The outcomes of a design (designs.py) for S registrations: the files that hold them, and what explainers get."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.axes import Axes
from gpca.io.csv_file import numbers, read_csv, write_csv
from gpca.pairs.dataset import Registrations


@dataclass(frozen=True)
class Outcomes:
    """S registrations under K conditions.

    Attributes:
        sample, split: (S,) which registrations.
        covariance: (S, K, 6, 6) of the pose twists, radians and diameters.
        uncertainty: (S, K) u of the condition against the design's clean one, nats.
        residual: (S, K) log distance from the target to the source, diameters.
        degenerate: (S, K) the covariance says nothing: no correspondences in any run, or one pose in all.
        icp_calls: (S, K) runs of ICP.
    """

    sample: np.ndarray
    split: np.ndarray
    covariance: np.ndarray
    uncertainty: np.ndarray
    residual: np.ndarray
    degenerate: np.ndarray
    icp_calls: np.ndarray

    def save(self, path: str | Path, axes: Axes) -> None:
        """Write the npz described in results/README.md; `axes` are the source and the seed."""
        save_arrays(path, {field.name: getattr(self, field.name) for field in fields(self)}, axes)

    def write_table(self, path: str | Path, conditions: Sequence[str]) -> None:
        """Write the uncertainties as CSV, in nats, a column for each of the K conditions, for readers and metrics."""
        import pandas as pd

        columns = {"sample": self.sample, "split": self.split}
        columns |= {f"uncertainty_{condition}": self.uncertainty[:, k] for k, condition in enumerate(conditions)}
        write_csv(path, pd.DataFrame(columns))

    def attach_to(
        self, registrations: Registrations, seconds_S_K: np.ndarray, icp_seconds_S_K: np.ndarray
    ) -> Registrations:
        """Return those of the registrations that were evaluated, with everything of the outcomes attached."""
        row_of = {key: row for row, key in enumerate(zip(registrations.split, registrations.sample, strict=True))}
        rows = [row_of.get(key) for key in zip(self.split, self.sample, strict=True)]
        if None in rows:
            raise InputError("uncertainty", "holds samples that the registrations lack", "regenerate both")
        names = ("covariance", "uncertainty", "residual", "degenerate", "icp_calls")
        own = {name: getattr(self, name) for name in names}
        seconds = {"seconds": seconds_S_K, "icp_seconds": icp_seconds_S_K}
        chosen = registrations.subset(np.array(rows))
        return replace(chosen, attached={**chosen.attached, **own, **seconds})

    @classmethod
    def load(cls, path: str | Path, axes: Axes | None = None) -> Outcomes:
        """Read the npz; `axes` are the source and the seed that it has to be of.

        Raises:
            InputError: the file is missing, damaged, of another source or seed, holds wrong shapes, NaN, or no samples.
        """
        shapes: dict[str, tuple[int | str, ...]] = dict.fromkeys((field.name for field in fields(cls)), ("S", "K"))
        shapes |= {"sample": ("S",), "split": ("S",), "covariance": ("S", "K", 6, 6)}
        kinds = dict.fromkeys(shapes, REAL) | {"sample": WHOLE, "split": TEXT, "icp_calls": WHOLE, "degenerate": "b"}
        arrays = load_arrays(path, shapes, "python -m gpca uncertainty", kinds, axes)
        remedy = "regenerate it with 'python -m gpca uncertainty'"
        if len(arrays["sample"]) == 0:
            raise InputError(path, "has no samples", remedy)
        for name, values in {
            "covariance": np.diagonal(arrays["covariance"], axis1=2, axis2=3),
            "icp_calls": arrays["icp_calls"],
        }.items():
            if (values < 0).any():
                raise InputError(path, f"'{name}' contains impossible values", remedy)
        return cls(**{name: arrays[name] for name in shapes})


def write_seconds(path: str | Path, outcomes: Outcomes, seconds_S_K: np.ndarray, icp_seconds_S_K: np.ndarray) -> None:
    """Write the seconds of every sample and condition, apart from the outcomes: they differ from run to run."""
    import pandas as pd

    conditions = seconds_S_K.shape[1]
    columns = {name: np.repeat(getattr(outcomes, name), conditions) for name in ("sample", "split")}
    columns |= {"condition": np.tile(np.arange(conditions), len(seconds_S_K))}
    columns |= {"seconds": seconds_S_K.ravel(), "icp_seconds": icp_seconds_S_K.ravel()}
    write_csv(path, pd.DataFrame(columns))


def read_seconds(path: str | Path, outcomes: Outcomes) -> tuple[np.ndarray, np.ndarray]:
    """Return seconds (S, K) and seconds inside ICP (S, K).

    Raises:
        InputError: missing or damaged file, missing column, or other samples and conditions than the outcomes'.
    """
    rows = read_csv(path, ("sample", "split", "condition", "seconds", "icp_seconds"))
    shape = outcomes.uncertainty.shape
    remedy = "regenerate it with 'python -m gpca uncertainty'"
    if len(rows) != np.prod(shape):
        raise InputError(path, f"has {len(rows)} rows, not {shape[0]} samples × {shape[1]} conditions", remedy)
    expected = {"sample": outcomes.sample[:, None], "split": outcomes.split[:, None], "condition": np.arange(shape[1])}
    for name, values in expected.items():
        found = (rows[name] if name == "split" else numbers(path, rows, name)).to_numpy().reshape(shape)
        if not (found == values).all():
            raise InputError(path, "its samples or conditions differ from those of the outcomes", remedy)
    seconds, icp_seconds = (
        numbers(path, rows, name, least=0).to_numpy().reshape(shape) for name in ("seconds", "icp_seconds")
    )
    return seconds, icp_seconds
