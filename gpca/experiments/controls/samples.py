"""The severity of each test sample's perturbation, and the final error of its registration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.rigid import inverse
from gpca.causes.subjects import read_subjects
from gpca.io.csv_file import read_numbers
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations

if TYPE_CHECKING:
    import pandas as pd

OF_CONCEPT = {"noise": ("noise",), "pose": ("rotation_deg", "translation"), "overlap": ("crop",)}
SEVERITIES = tuple(name for names in OF_CONCEPT.values() for name in names)
COLUMNS = ("sample", "object", "concept", *SEVERITIES, "error")


def sample_table(registrations: Registrations, objects: ObjectClouds) -> pd.DataFrame:
    """Return severities and final error of the test samples: ADD, or ADD-S where symmetric, in diameters."""
    import pandas as pd

    subjects = {subject.name: subject for subject in read_subjects(objects)}
    rows = registrations.rows("test")
    errors = []
    for row in rows:
        left = registrations.T_target_source("icp", row) @ inverse(registrations.T_target_source("true", row))
        errors.append(subjects[str(registrations.object_name[row])].errors(left[None])[0])
    return pd.DataFrame(
        {
            "sample": registrations.sample[rows],
            "object": registrations.object_name[rows],
            "concept": registrations.concept[rows],
            "noise": registrations.severity_noise[rows],
            "rotation_deg": np.rad2deg(registrations.severity_rotation_rad[rows]),
            "translation": registrations.severity_translation[rows],
            "crop": registrations.severity_crop[rows],
            "error": errors,
        }
    )


def read_samples(path: str | Path) -> pd.DataFrame:
    """Read what :func:`sample_table` returned; InputError for an unusable file."""
    return read_numbers(path, COLUMNS, (*SEVERITIES, "error"))
