"""The failures with measured causes that the page shows in 3-D."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gpca.causes.candidate import replay
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.truth import BY_SIZE, FAILED
from gpca.model.scene import flat, packed, packed_pair, taken_out
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.figures.cloud_views import thinned
from gpca.rigid import inverse, transform
from gpca.seeds import seed_of_file

RULE = (
    "These are failed test registrations whose causes were measured: of every source, the first of each dominant cause "
    "in the run's first seed that fails from the shown start, too."
)
POINTS = 600  # of a shown cloud at most
UNIT, DIAMETER = "% of the diameter", 100  # unit of lengths on the page
TRUTH = "pose:0"  # the view of the true pose


def first_of_each_cause(causes: Causes) -> list[int]:
    """Return the rows of `RULE`, concept by concept."""
    registrations, truth = causes.registrations, causes.truth
    failed_S = (truth.state == FAILED) & (causes.error_shown > truth.failed_limit)
    test = np.flatnonzero((registrations.split == "test") & failed_S)
    in_order = test[np.argsort(registrations.sample[test], kind="stable")]
    return [int(row) for concept in CONCEPTS for row in in_order[truth.dominant[in_order] == concept][:1]]


def cause_samples(files: Mapping[str, str | Path], source: Mapping, settings: CauseSettings) -> list[dict]:
    """Return the samples of one source by `RULE`, as JSON values for the page's 3-D view; lengths in % of the diameter.

    `files` are ``objects`` of the source, and ``causes`` of its first seed.
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


def packed_registration(registrations: Registrations, row: int, reach: float, observed_8: Sequence[np.ndarray]) -> dict:
    """Return a registration for ``view.js``: in its initial, aligned and true pose.

    `observed_8` are the observed clouds (P, 3) as aligned by ICP with each subset of the causes, in the order of
    :data:`gpca.causes.truth.SUBSETS`. A repeated registration is packed once, and referred to by its number afterwards.
    """
    target = thinned(registrations.target(row).astype(float), POINTS)
    T_centered = np.eye(4)
    T_centered[:3, 3] = -(target.min(axis=0) + target.max(axis=0)) / 2
    T_init, T_icp, T_true = (T_centered @ registrations.T_target_source(name, row) for name in ("init", "icp", "true"))
    source = transform(T_init, thinned(registrations.source(row), POINTS))
    pair = packed_pair(transform(T_centered, target), source, T_icp @ inverse(T_init), reach, DIAMETER, UNIT)
    what_ifs: list[dict | int] = []
    titles = {TRUTH: "In the true pose"}
    for number, subset in enumerate(BY_SIZE):
        cloud = packed(transform(T_centered, thinned(observed_8[subset], POINTS)))
        what_ifs.append(what_ifs.index(cloud) if cloud in what_ifs else cloud)
        words = taken_out(subset)
        titles[f"what:0:{number}"] = f"Registered again, {words[:1].lower()}{words[1:]}"
    return pair | {"poses": [{"T": flat(T_true @ inverse(T_init)), "what_ifs": what_ifs}], "titles": titles}


def _percent(share: float) -> float:
    return round(100 * float(share), 2)
