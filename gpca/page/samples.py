"""The registrations that the page shows in 3-D: with GP-CA's predictions, and with measured causes."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.causes.candidate import replay
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings, Limits
from gpca.causes.truth import BY_SIZE, FAILED
from gpca.errors import InputError
from gpca.experiments.registration_stages import observed_uncertainties, registration_error, state_of_error
from gpca.model.scene import flat, packed, packed_pair, taken_out
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import thinned
from gpca.rigid import inverse, transform
from gpca.seeds import seed_of_file

OF_EACH_CONCEPT = 2  # samples in every source
RULE = (
    f"Of every source, the first {OF_EACH_CONCEPT} test samples of each concept in the run's first seed, in the order "
    "of their numbers, right or wrong."
)
CAUSES_RULE = (
    "First come failed test registrations whose causes were measured: of every source, the first of each dominant "
    "cause in the run's first seed that fails from the shown start, too."
)
POINTS = 600  # of a shown cloud at most
UNIT, DIAMETER = "% of the diameter", 100  # unit of lengths on the page
TRUTH = "pose:0"  # the view of the true pose


def page_samples(files: Mapping[str, str | Path], source: Mapping, limits: Limits, reach: float) -> list[dict]:
    """Return the samples of one source by `RULE`, as JSON values for the page's 3-D view.

    The ADD-S after ICP is in % of the diameter, the uncertainty in nats, with the 95th percentile of clean pairs.
    `files` are ``registrations`` and ``predictions`` of one source and seed, optionally ``uncertainty``; `reach` is the
    correspondence distance of ICP, in diameters.
    """
    registrations, predictions = Registrations.load(files["registrations"]), read_predictions(files["predictions"])
    u_S, clean = np.full(len(registrations), np.nan), np.nan
    if "uncertainty" in files:
        u_S, clean = observed_uncertainties(files["uncertainty"], registrations)
    test = predictions[predictions["split"] == "test"].set_index("sample")
    samples = []
    for row in first_of_each_concept(registrations):
        number = str(registrations.sample[row])
        if number not in test.index:
            fault = f"lacks test sample {number} of {files['registrations']}"
            raise InputError(files["predictions"], fault, "regenerate both")
        prediction, error = test.loc[number], registration_error(registrations, row)
        named = {c: (prediction[f"score_{c}"], np.sqrt(prediction[f"variance_{c}"])) for c in concepts_of(predictions)}
        scores = [{"concept": c, "mean": _number(m), "deviation": _number(d)} for c, (m, d) in named.items()]
        samples.append(
            {
                "object": str(registrations.object_name[row]),
                "sample": int(registrations.sample[row]),
                "concept": str(registrations.concept[row]),
                "severity": severity_words(registrations, row),
                "fitness": _number(registrations.fitness[row]),
                "predicted": str(prediction["concept_predicted"]),
                "scores": scores,
                "error_percent": _number(100 * error),
                "state": state_of_error(error, limits),
                "scene": packed_registration(registrations, row, reach),
                "uncertainty": _number(u_S[row]),
                "clean_uncertainty": _number(clean),
                "source": dict(source),
            }
        )
    return samples


def first_of_each_concept(registrations: Registrations) -> list[int]:
    """Return the rows of `RULE`, concept by concept."""
    return _first_of_each(registrations, registrations.concept, np.ones(len(registrations), bool), OF_EACH_CONCEPT)


def first_of_each_cause(causes: Causes) -> list[int]:
    """Return the rows of `CAUSES_RULE`, concept by concept."""
    failed_S = (causes.truth.state == FAILED) & (causes.error_shown > causes.truth.failed_limit)
    return _first_of_each(causes.registrations, causes.truth.dominant, failed_S, 1)


def _first_of_each(registrations: Registrations, concept_S: np.ndarray, chosen_S: np.ndarray, count: int) -> list[int]:
    test = np.flatnonzero((registrations.split == "test") & chosen_S)
    in_order = test[np.argsort(registrations.sample[test], kind="stable")]
    return [int(row) for concept in CONCEPTS for row in in_order[concept_S[in_order] == concept][:count]]


def severity_words(registrations: Registrations, row: int) -> str:
    """Return a sample's perturbation in words; lengths are in % of the object's diameter."""
    concept = str(registrations.concept[row])
    if concept == "noise":
        return f"σ = {100 * registrations.severity_noise[row]:.1f} % of the diameter"
    if concept == "pose":
        angle_deg = np.degrees(registrations.severity_rotation_rad[row])
        return f"turned by {angle_deg:.0f}°, moved by {100 * registrations.severity_translation[row]:.0f} %"
    return f"{100 * registrations.severity_crop[row]:.0f} % of the points cut off"


def cause_samples(files: Mapping[str, str | Path], source: Mapping, settings: CauseSettings) -> list[dict]:
    """Return the samples of one source by `CAUSES_RULE`, as JSON values for the page's 3-D view.

    In % of the diameter are the shown error, the limit of failures, the share φ of each concept, and the mean error
    without each subset of the causes. `files` are ``objects`` of the source, and ``causes`` of its first seed.
    """
    causes = Causes.load(files["causes"])
    rows = first_of_each_cause(causes)
    if not rows:
        return []
    objects = ObjectClouds.load(files["objects"])
    name, seed = Path(files["causes"]).parent.name, seed_of_file(files["causes"])
    registrations, truth = causes.registrations, causes.truth
    samples = []
    for row in rows:
        _, observed_8 = replay(objects, causes, row, name, seed, settings)
        phi, errors = truth.phi[row], truth.error[row]
        samples.append(
            {
                "object": str(registrations.object_name[row]),
                "sample": int(registrations.sample[row]),
                "concept": str(truth.dominant[row]),
                "state": str(truth.state[row]),
                "source": dict(source),
                "error_percent": _percent(causes.error_shown[row]),
                "limit": _percent(truth.failed_limit),
                "shares": [{"concept": concept, "percent": _percent(phi[i])} for i, concept in enumerate(CONCEPTS)],
                "what_ifs": [{"words": taken_out(each), "percent": _percent(errors[each])} for each in BY_SIZE],
                "scene": packed_registration(registrations, row, settings.icp.correspondence_distance, observed_8),
            }
        )
    return samples


def packed_registration(
    registrations: Registrations, row: int, reach: float, observed_8: Sequence[np.ndarray] = ()
) -> dict:
    """Return a registration for ``view.js``: in its initial, aligned and true pose.

    `observed_8` are the observed clouds (P, 3) as aligned by ICP with each subset of the causes, in the order of
    :data:`gpca.causes.truth.SUBSETS`; none without measured causes. A repeated registration is packed once, and
    referred to by its number afterwards.
    """
    target = thinned(registrations.target(row).astype(float), POINTS)
    T_centered = np.eye(4)
    T_centered[:3, 3] = -(target.min(axis=0) + target.max(axis=0)) / 2
    T_init, T_icp, T_true = (T_centered @ registrations.T_target_source(name, row) for name in ("init", "icp", "true"))
    source = transform(T_init, thinned(registrations.source(row), POINTS))
    pair = packed_pair(transform(T_centered, target), source, T_icp @ inverse(T_init), reach, DIAMETER, UNIT)
    what_ifs: list[dict | int] = []
    titles = {TRUTH: "In the true pose"}
    for number, subset in enumerate(BY_SIZE if observed_8 else ()):
        cloud = packed(transform(T_centered, thinned(observed_8[subset], POINTS)))
        what_ifs.append(what_ifs.index(cloud) if cloud in what_ifs else cloud)
        words = taken_out(subset)
        titles[f"what:0:{number}"] = f"Registered again, {words[:1].lower()}{words[1:]}"
    return pair | {"poses": [{"T": flat(T_true @ inverse(T_init)), "what_ifs": what_ifs}], "titles": titles}


def _percent(share: float) -> float:
    return round(100 * float(share), 2)


def _number(value: float) -> float | None:
    """Return a rounded number; None for NaN, which JSON lacks: the score of an explainer that abstains."""
    return round(float(value), 3) if np.isfinite(value) else None
