"""Which cloud of a registration an encoder sees: the paper says "ICP-aligned source" and leaves the direction open."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np

from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import ICP, ICPSettings
from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.errors import InputError
from gpca.pairs.dataset import Registrations, ragged

Reading = Literal["aligned", "observed", "reversed"]
READINGS: tuple[str, ...] = get_args(Reading)


def read_as(reading: str, registrations: Registrations, icp: ICPSettings) -> Registrations:
    """Return the registrations such that their clouds are what the encoder sees.

    Args:
        reading: ``aligned`` as ICP left the observed cloud; ``observed`` as it was before ICP, at the initial pose;
            ``reversed`` aligned by ICP from the model to it.
        icp: how it runs anew, for ``reversed``.

    Raises:
        InputError: an unknown reading.
    """
    if reading == "aligned":
        return registrations
    if reading == "observed":
        rows = range(len(registrations))
        starts = [transform(registrations.T_target_source("init", row), registrations.source(row)) for row in rows]
        clouds = [start.astype(np.float32) for start in starts]
        seen: dict[str, Any] = ragged(clouds, [registrations.target(row) for row in rows])
        return replace(registrations, **seen, T_target_source_icp=registrations.T_target_source_init)
    if reading == "reversed":
        return registered_backwards(registrations, icp)
    raise InputError(f"reading '{reading}'", "unknown", f"choose one of {', '.join(READINGS)}")


def registered_backwards(registrations: Registrations, settings: ICPSettings) -> Registrations:
    """Return the same pairs aligned by ICP from the model to what was observed.

    The encoder sees the observed cloud as before, moved by the inverse of ICP's result into the frame of the model.
    """
    clouds, targets, poses, fits = [], [], [], []
    for row in range(len(registrations)):
        target = registrations.target(row).astype(np.float64)
        T_init = registrations.T_target_source("init", row)
        observed = registrations.source(row)
        normals = None if settings.method == "point_to_point" else estimate_normals(observed)
        backwards = ICP(observed, normals, settings).register(target, inverse(T_init))
        T_target_source = inverse(backwards.T_target_source)  # ICP's target was the source
        clouds.append(transform(T_target_source, observed).astype(np.float32))
        targets.append(registrations.target(row))
        poses.append(scale_translation(T_target_source, float(registrations.diameter_m[row])))
        fits.append((backwards.fitness, backwards.inlier_rmse))
    fitness, inlier_rmse = np.array(fits).T
    changed: dict[str, Any] = {"T_target_source_icp": np.array(poses), "fitness": fitness, "inlier_rmse": inlier_rmse}
    return replace(registrations, **changed | ragged(clouds, targets), attached={})
