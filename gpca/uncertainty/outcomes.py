"""The outcomes of a design (designs.py) for S registrations: their files, and their form for explainers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import FLAG, Container, array, require_same_samples
from gpca.io.csv_file import read_columns, write_columns
from gpca.pairs.dataset import Registrations


@dataclass(frozen=True)
class Outcomes(Container):
    """S registrations under K conditions."""

    sample: np.ndarray = array("S", WHOLE)
    split: np.ndarray = array("S", TEXT)
    covariance: np.ndarray = array("S K 6 6")  # of the pose twists, radians and diameters
    uncertainty: np.ndarray = array("S K")  # u of the condition against the design's clean one, nats
    residual: np.ndarray = array("S K")  # log distance from the target to the source, diameters
    # Whether the covariance says nothing: no correspondences in any run, or one pose in all.
    degenerate: np.ndarray = array("S K", FLAG)
    icp_calls: np.ndarray = array("S K", WHOLE)

    def write_table(self, path: str | Path, conditions: Sequence[str]) -> None:
        """Write the uncertainties as CSV, in nats, a column for each of the K conditions, for readers and metrics."""
        columns = {"sample": self.sample, "split": self.split}
        columns |= {f"uncertainty_{condition}": self.uncertainty[:, k] for k, condition in enumerate(conditions)}
        write_columns(path, columns)

    def attach_to(
        self, registrations: Registrations, seconds_S_K: np.ndarray, icp_seconds_S_K: np.ndarray
    ) -> Registrations:
        """Return those of the registrations that were evaluated, with everything of the outcomes attached."""
        row_of = {key: row for row, key in enumerate(zip(registrations.split, registrations.sample, strict=True))}
        rows = [row_of.get(key) for key in zip(self.split, self.sample, strict=True)]
        if None in rows:
            raise InputError("uncertainty", "holds samples that the registrations lack", "regenerate both")
        own = {name: getattr(self, name) for name in self.array_fields() if name not in ("sample", "split")}
        seconds = {"seconds": seconds_S_K, "icp_seconds": icp_seconds_S_K}
        chosen = registrations.subset(np.array(rows))
        return replace(chosen, attached={**chosen.attached, **own, **seconds})


def write_seconds(path: str | Path, outcomes: Outcomes, seconds_S_K: np.ndarray, icp_seconds_S_K: np.ndarray) -> None:
    """Write the seconds of every sample and condition, apart from the outcomes: they differ from run to run."""
    conditions = seconds_S_K.shape[1]
    columns = {name: np.repeat(getattr(outcomes, name), conditions) for name in ("sample", "split")}
    columns |= {"condition": np.tile(np.arange(conditions), len(seconds_S_K))}
    columns |= {"seconds": seconds_S_K.ravel(), "icp_seconds": icp_seconds_S_K.ravel()}
    write_columns(path, columns)


def read_seconds(path: str | Path, outcomes: Outcomes) -> tuple[np.ndarray, np.ndarray]:
    """Return seconds (S, K) and seconds inside ICP (S, K) of the outcomes' samples."""
    columns = ("sample", "split", "condition", "seconds", "icp_seconds")
    rows = read_columns(path, columns, ("seconds", "icp_seconds"))
    shape = outcomes.uncertainty.shape
    repeated = {name: np.repeat(getattr(outcomes, name), shape[1]) for name in ("sample", "split")}
    require_same_samples(path, rows, repeated, "outcomes")
    return np.asarray(rows["seconds"]).reshape(shape), np.asarray(rows["icp_seconds"]).reshape(shape)
