"""The CSV beside registrations of depth frames: the instance that each sample shows, and its pose errors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError
from gpca.io.csv_file import numbers, read_csv
from gpca.pairs.dataset import Registrations

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("sample", "split", "instance", "dataset", "in_training")
FRAME_COLUMNS = (  # all that the file may hold
    *COLUMNS,
    *("concept", "scene", "image", "object", "symmetric", "init_from", "init_error", "icp_error", "lost_to"),
)


def read_samples_of_frames(path: str | Path) -> pd.DataFrame:
    """Read the columns that tell samples apart, as text but for `in_training`."""
    rows = read_csv(path, COLUMNS, others=FRAME_COLUMNS)
    return rows.assign(in_training=rows["in_training"] == "True")


def read_instances_of(path: str | Path, registrations: Registrations) -> np.ndarray:
    """Return the instance (S,) that each registration shows.

    Raises:
        InputError: the file is of other samples.
    """
    rows = read_samples_of_frames(path)
    for name in ("sample", "split"):
        if rows[name].tolist() != getattr(registrations, name).astype(str).tolist():
            raise InputError(
                path, "its samples differ from those of the registrations", "regenerate both from the same config"
            )
    return numbers(path, rows, "instance", least=0).to_numpy(int)
