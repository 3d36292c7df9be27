"""How far off a registration is, and what that is called: what the figures and the page say of one."""

from __future__ import annotations

from gpca.alignment.pose_error import adds_error
from gpca.alignment.rigid import inverse, transform
from gpca.causes.settings import Limits
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.pairs.dataset import Registrations

LIMITS = Limits()


def registration_error(registrations: Registrations, row: int) -> float:
    """Return the ADD-S of a row's pose after ICP in diameters; of clouds this sparse it is about 0.01 at best."""
    T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
    return adds_error(transform(inverse(T_true), registrations.target(row)), T_icp, T_true)


def state_of_error(error: float) -> str:
    """Return ``nominal``, ``borderline`` or ``failed`` by the limits of docs/causes.md, without the uncertainty's."""
    if error < LIMITS.nominal:
        return NOMINAL
    return FAILED if error > LIMITS.failed else BORDERLINE
