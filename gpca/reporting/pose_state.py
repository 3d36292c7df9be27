"""How far off a registration is, what that is called, and how uncertain it is: what figures and page say of one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gpca.alignment.pose_error import adds_error
from gpca.alignment.rigid import inverse, transform
from gpca.attribution.metrics import read_uncertainties
from gpca.causes.settings import Limits
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.errors import InputError
from gpca.pairs.dataset import Registrations


def registration_error(registrations: Registrations, row: int) -> float:
    """Return the ADD-S of a row's pose after ICP in diameters; of clouds this sparse it is about 0.01 at best."""
    T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
    return adds_error(transform(inverse(T_true), registrations.target(row)), T_icp, T_true)


def state_of_error(error: float, limits: Limits) -> str:
    """Return ``nominal``, ``borderline`` or ``failed`` by the limits of docs/causes.md, without the uncertainty's."""
    if error < limits.nominal:
        return NOMINAL
    return FAILED if error > limits.failed else BORDERLINE


def observed_uncertainties(path: str | Path, registrations: Registrations) -> tuple[np.ndarray, float]:
    """Return u (S,) of the registrations in nats, NaN where the file has none, and the limit of the clean ones.

    Raises:
        InputError: see :func:`gpca.attribution.metrics.read_uncertainties`; also a file without any of the samples.
    """
    observed, limit = read_uncertainties(path)
    samples = list(zip(registrations.split.tolist(), registrations.sample.astype(str).tolist(), strict=True))
    u_S = observed.reindex(samples).to_numpy(float)
    if np.isnan(u_S).all():
        raise InputError(path, "its samples differ from those of the registrations", "regenerate both")
    return u_S, limit
