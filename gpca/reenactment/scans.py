"""Re-enactments of registrations of scans: the counterfactuals of scans, at hypotheses of the true pose."""

from collections.abc import Sequence

import numpy as np

from gpca.causes.dataset import Causes
from gpca.causes.scans import OverlapErrors, ScanCandidate
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.enactment import QUIET, Enactment, NoiseScale, enact
from gpca.reenactment.hypotheses import Hypothesis, find_hypotheses
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, transform
from gpca.scans.pair import near
from gpca.seeds import generator

REACH = 2.0  # of the target's spacing: so near points of the two scans show the same surface


def reenact_scans(
    causes: Causes,
    error_factor_S: np.ndarray,
    settings: ReenactmentSettings,
    truth: CauseSettings,
    T_found_S: Sequence[np.ndarray] | None = None,
) -> Reenactments:
    """Return the re-enactments of every row; of the causes it reads what may be observed."""

    def world(pair: ObservedPair, row: int) -> list[Enactment]:
        surface = ModelSurface(pair.model)
        before = transform(pair.T_init, pair.observed)
        random = generator(*pair.axes, "hypotheses")
        found_n = pair.T_runs @ inverse(pair.T_init)
        if T_found_S is not None and len(T_found_S[row]):
            found_n = np.concatenate([found_n, T_found_S[row]])
        hypotheses = find_hypotheses(before, surface, found_n, settings, random)
        scale, enactments = NoiseScale(surface, random), []
        for hypothesis in hypotheses:
            candidate = cropped(hypothesis, before, surface, scale)
            errors = OverlapErrors(candidate.clean[candidate.seen], float(error_factor_S[row]))
            enactments.append(enact(hypothesis, candidate, errors, pair.axes, truth, misses=True))
        return enactments

    return reenact_all(causes, *(causes.registrations.axes or ("", None)), settings, truth, world)[0]


def cropped(hypothesis: Hypothesis, before: np.ndarray, surface: ModelSurface, scale: NoiseScale) -> ScanCandidate:
    """Return the pair as a candidate, were a hypothesis true; where hardly any point is common, nothing is cropped."""
    points, reach = transform(hypothesis.T, before), REACH * surface.spacing
    common_N, common_M = near(points, surface.points, reach), near(surface.points, points, reach)
    share = float(common_N.mean())
    if min(common_N.sum(), common_M.sum()) < FEWEST_POINTS:
        common_N, common_M = np.ones(len(points), bool), np.ones(len(surface.points), bool)
    residuals, rows = surface.residuals(points)
    noise = scale.noise(residuals[common_N])
    moved_N = np.where(common_N, residuals, 0.0) * (noise**2 / (noise**2 + surface.roughness) if noise > QUIET else 0.0)
    return ScanCandidate(
        applied=np.array([noise > QUIET, True, not (common_N.all() and common_M.all())]),  # noise, pose, overlap
        model=surface.points,
        noisy_model=surface.points,
        clean=points - moved_N[:, None] * surface.normals[rows],
        noisy=points,
        seen=np.flatnonzero(common_N),
        model_common=np.flatnonzero(common_M),
        kept=np.arange(len(points)),
        T_near=np.eye(4),
        T_init=inverse(hypothesis.T),
        severity={"noise": noise, "outliers": 1 - share, "crop": 1 - share},
    )
