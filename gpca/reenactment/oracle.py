"""Re-enactments that know the truth about some of the causes: how much is lost by estimating each of them."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from gpca.causes.candidate import Candidate, drawn_again
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.descriptors import observed_pair
from gpca.causes.settings import CauseSettings
from gpca.classifier.scores import Attribution
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import NOISE, OVERLAP, POSE
from gpca.process.progress import progress
from gpca.reenactment.dataset import verdict
from gpca.reenactment.enactment import Enactment, NoiseScale, enact, observe, rebuild, reenact
from gpca.reenactment.hypotheses import hypothesis_at, weights_of
from gpca.reenactment.settings import KNOWN, ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, transform
from gpca.seeds import generator


def ask_oracles(
    objects: ObjectClouds, causes: Causes, source: str, seed: int, settings: ReenactmentSettings, truth: CauseSettings
) -> dict[str, Attribution]:
    """Diagnose every row by re-enactments that know more or less (:data:`gpca.reenactment.settings.KNOWN`)."""
    scores: dict[str, list[np.ndarray]] = {name: [] for name in KNOWN}
    for row in progress(range(len(causes)), f"oracles of {source}, seed {seed}"):
        pair = observed_pair(causes, row, source, seed, "reenactment")
        true, _ = drawn_again(objects, causes, row, source, seed, truth)
        for name, scores_4 in verdicts(pair, true, settings, truth).items():
            scores[name].append(scores_4)
    return {name: Attribution.of_scores(LABELS, np.array(rows), seconds=0.0) for name, rows in scores.items()}


def verdicts(
    pair: ObservedPair, true: Candidate, settings: ReenactmentSettings, truth: CauseSettings
) -> dict[str, np.ndarray]:
    """Verdict (4,) of :func:`gpca.reenactment.dataset.verdict` on the pair that a candidate is, by what is known."""
    surface, T_start = ModelSurface(pair.model), true.start(true.present)
    estimated = reenact(pair, settings, truth, surface)
    random = generator(*pair.axes, "true pose")
    before, scale = transform(pair.T_init, pair.observed), NoiseScale(surface, random)
    hypothesis = hypothesis_at(inverse(T_start), before, surface, settings, random)
    candidate = rebuild(hypothesis.T, observe(before, hypothesis, surface, scale, random), surface, random)
    at_truth = [enact(hypothesis, candidate, surface.errors, pair.axes, truth)]

    def errors(enactment: Enactment, clouds: Collection[int]) -> np.ndarray:
        """Return v̂ (8,) of a hypothesis with the truth about the clouds, as far as it is known."""
        if not clouds:
            return enactment.error_8
        random = generator(*pair.axes, "oracle", *clouds)
        candidate = informed(enactment.candidate, enactment.hypothesis.T @ T_start, true, clouds, random)
        return enact(enactment.hypothesis, candidate, surface.errors, pair.axes, truth).error_8

    by_name = {}
    for name, known in KNOWN.items():
        enactments = at_truth if POSE in known else estimated
        clouds = [cause for cause in (NOISE, OVERLAP) if cause in known]
        error_K_8 = np.array([errors(enactment, clouds) for enactment in enactments])
        weight_K = weights_of(enactment.hypothesis for enactment in enactments)
        by_name[name] = verdict(error_K_8[None], weight_K[None], truth.limits)[0]
    return by_name


def informed(
    rebuilt: Candidate, T_model_true: np.ndarray, true: Candidate, known: Collection[int], random: np.random.Generator
) -> Candidate:
    """Return a rebuilt candidate with the truth about noise or overlap, or both, in the place of what was estimated.

    A cause that was not applied is none then. Surface that was missing is as noisy as the truth says, where that is
    known, else as the rest was found to be. The pose takes what truly lies in the model to where the hypothesis has it.
    """
    kept, hidden = true.seen, true.seen[:0]  # the rows that were observed, and those that overlap took away
    if true.applied[OVERLAP]:
        kept, hidden = true.kept, np.setdiff1d(true.seen, true.kept)
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
        jitter, anywhere = random.normal(size=added.shape), random.uniform(-0.5, 0.5, size=added.shape)
        is_outlier = random.random(len(added)) < outliers
        measured = np.where(is_outlier[:, None], anywhere, added + noise * jitter)
    return replace(
        rebuilt,
        applied=applied,
        clean=np.concatenate([clean, added]),
        noisy=np.concatenate([observed, measured]),
        seen=np.arange(N + len(added)),
        kept=np.arange(N),
    )
