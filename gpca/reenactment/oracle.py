"""Re-enactments that know the truth about some of the causes: how much is lost by estimating each of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.attribution.scores import Attribution
from gpca.causes.candidate import Candidate, candidate_of, surface_of
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.descriptors import observed_pair
from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.process.progress import progress
from gpca.reenactment.dataset import verdict
from gpca.reenactment.enactment import Enactment, NoiseScale, enact, reenact, register, start_twists
from gpca.reenactment.hypotheses import hypothesis_at, weights_of
from gpca.reenactment.settings import KNOWN, ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.seeds import generator

SAME = 1e-3  # diameters; points that were drawn again lie no farther from those in the file, which are rounded


def ask_oracles(
    objects: ObjectClouds, causes: Causes, source: str, seed: int, settings: ReenactmentSettings, truth: CauseSettings
) -> dict[str, Attribution]:
    """Diagnose every row by a re-enactment, for each thing that it may know (:data:`gpca.reenactment.settings.KNOWN`).

    Args:
        objects: that the rows show.
        truth: how counterfactuals are registered, and how the rows were drawn.

    Raises:
        InputError: the objects or the settings are not those that the rows were drawn with.
    """
    scores: dict[str, list[np.ndarray]] = {name: [] for name in KNOWN}
    for row in progress(range(len(causes)), f"oracles of {source}, seed {seed}"):
        pair = observed_pair(causes, row, source, seed, "reenactment")
        true = candidate_of(causes, row, surface_of(objects, causes, row), source, seed, truth)
        if not _is_pair_of(true, pair):
            sample = causes.registrations.sample[row]
            remedy = "regenerate the causes from a single config"
            raise InputError(f"sample {sample} of {source}", "is not reproduced by these settings", remedy)
        for name, scores_4 in verdicts(pair, true, settings, truth).items():
            scores[name].append(scores_4)
    return {name: Attribution.of_scores(LABELS, np.array(rows), seconds=0.0) for name, rows in scores.items()}


def verdicts(
    pair: ObservedPair, true: Candidate, settings: ReenactmentSettings, truth: CauseSettings
) -> dict[str, np.ndarray]:
    """Verdict (4,) of :func:`gpca.reenactment.dataset.verdict` on one pair, by what is known.

    Args:
        true: the candidate that the pair is.
    """
    enacting = _Enacting(pair, true, truth, ModelSurface(pair.model), start_twists(pair.axes, truth))
    estimated, at_truth = reenact(pair, settings, truth, enacting.surface), [enacting.at_the_true_pose(settings)]
    by_name = {}
    for name, known in KNOWN.items():
        enactments = at_truth if POSE in known else estimated
        error_K_8 = np.array([enacting.errors(enactment, known) for enactment in enactments])
        weight_K = weights_of(enactment.hypothesis for enactment in enactments)
        by_name[name] = verdict(error_K_8[None], weight_K[None], truth.limits)[0]
    return by_name


@dataclass(frozen=True)
class _Enacting:
    """A pair with its truth, and what the enactments of all hypotheses share."""

    pair: ObservedPair
    true: Candidate
    truth: CauseSettings
    surface: ModelSurface
    xi_n_6: np.ndarray

    def at_the_true_pose(self, settings: ReenactmentSettings) -> Enactment:
        random = generator(*self.pair.axes, "true pose")
        before, scale = transform(self.pair.T_init, self.pair.observed), NoiseScale(self.surface, random)
        hypothesis = hypothesis_at(inverse(_start(self.true)), before, self.surface, settings, random)
        return enact(before, hypothesis, self.surface, scale, self.xi_n_6, self.truth, random)

    def errors(self, enactment: Enactment, known: Collection[int]) -> np.ndarray:
        """Return v̂ (8,) of a hypothesis with the truth about the clouds, as far as it is known."""
        clouds = [cause for cause in (NOISE, OVERLAP) if cause in known]
        if not clouds:
            return enactment.error_8
        random = generator(*self.pair.axes, "oracle", *clouds)
        T_model_true = enactment.hypothesis.T @ _start(self.true)
        candidate = informed(enactment.candidate, T_model_true, self.true, clouds, random)
        errors = self.surface.errors
        return register(enactment.hypothesis, candidate, errors, self.xi_n_6, self.truth).error_8


def informed(
    rebuilt: Candidate, T_model_true: np.ndarray, true: Candidate, known: Collection[int], random: np.random.Generator
) -> Candidate:
    """Return a rebuilt candidate with the truth about noise or overlap, or both, in the place of what was estimated.

    A cause that was not applied is none then. Surface that was missing is as noisy as the truth says, where that is
    known, else as the rest was found to be.

    Args:
        rebuilt: of :func:`gpca.reenactment.enactment.rebuild`: the observed points come first.
        T_model_true: 4×4, where the hypothesis puts what truly lies in the model: the identity if it is right.
        true: the candidate that was observed.
    """
    kept, hidden = _parts(true)
    applied, N = rebuilt.applied.copy(), len(kept)
    observed, clean, added = rebuilt.noisy[:N], rebuilt.clean[:N], rebuilt.clean[N:]
    noise, outliers = rebuilt.severity["noise"], rebuilt.severity["outliers"]
    if NOISE in known:
        applied[NOISE] = true.applied[NOISE]
        clean = transform(T_model_true, true.clean[kept]) if applied[NOISE] else observed
        noise, outliers = true.severity["noise"], true.severity["outliers"]
    if OVERLAP in known:
        applied[OVERLAP] = true.applied[OVERLAP]
        added = transform(T_model_true, true.clean[hidden])
    if NOISE in known and OVERLAP in known:
        measured = transform(T_model_true, true.noisy[hidden])
    else:
        measured = _measured(added, noise, outliers, random)
    return replace(
        rebuilt,
        applied=applied,
        clean=np.concatenate([clean, added]),
        noisy=np.concatenate([observed, measured]),
        seen=np.arange(N + len(added)),
        kept=np.arange(N),
    )


def _measured(points: np.ndarray, noise: float, outliers: float, random: np.random.Generator) -> np.ndarray:
    jitter, anywhere = random.normal(size=points.shape), random.uniform(-0.5, 0.5, size=points.shape)
    is_outlier = random.random(len(points)) < outliers
    return np.where(is_outlier[:, None], anywhere, points + noise * jitter)


def _parts(true: Candidate) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows of a candidate's points that were observed, and of those that overlap took away."""
    if not true.applied[OVERLAP]:
        return true.seen, true.seen[:0]
    return true.kept, np.setdiff1d(true.seen, true.kept)


def _start(true: Candidate) -> np.ndarray:
    return true.start(_causes(true))


def _causes(true: Candidate) -> tuple[int, ...]:
    return tuple(np.flatnonzero(true.applied).tolist())


def _is_pair_of(true: Candidate, pair: ObservedPair) -> bool:
    observed = true.observed(_causes(true))
    before = transform(pair.T_init, pair.observed)
    return observed.shape == before.shape and np.abs(transform(_start(true), observed) - before).max() < SAME
