"""The severity of each test sample's perturbations, and the final error of its registration."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.rigid import inverse
from gpca.causes.measuring import Subject, read_subjects
from gpca.io.csv_file import read_numbers
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations

if TYPE_CHECKING:
    import pandas as pd

OF_CONCEPT = {"noise": ("noise",), "pose": ("rotation_deg", "translation"), "overlap": ("crop",)}
SEVERITIES = tuple(name for names in OF_CONCEPT.values() for name in names)
COLUMNS = ("control", "sample", "object", "concept", *SEVERITIES, "error")


def sample_table(asked: Mapping[str, Registrations], objects: ObjectClouds) -> pd.DataFrame:
    """Return severities and final error of the test samples: ADD, or ADD-S where symmetric, in diameters.

    Args:
        asked: the registrations of each control that has samples of its own, the paper's protocol among them.
    """
    import pandas as pd

    subjects = {subject.name: subject for subject in read_subjects(objects)}
    return pd.concat([_of_control(name, own, subjects) for name, own in asked.items()], ignore_index=True)


def _of_control(control: str, registrations: Registrations, subjects: Mapping[str, Subject]) -> pd.DataFrame:
    import pandas as pd

    rows = registrations.rows("test")
    errors = []
    for row in rows:
        left = registrations.T_target_source("icp", row) @ inverse(registrations.T_target_source("true", row))
        errors.append(subjects[str(registrations.object_name[row])].errors(left[None])[0])
    return pd.DataFrame(
        {
            "control": control,
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
