"""Picks the failed registrations that the page shows with their measured causes and counterfactuals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from gpca.causes.counterfactuals import replay
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import BY_SIZE
from gpca.causes.truth import FAILED
from gpca.model.scene import taken_out
from gpca.objects.canonical import ObjectClouds
from gpca.page.scenes import packed_registration
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of_file

RULE = (
    "Then follow the failed test registrations whose causes were measured: of every source, the first of each dominant "
    "cause in the run's first seed."
)


def cause_samples(files: Mapping[str, str | Path], source: Mapping, settings: CauseSettings) -> list[dict]:
    """Return the samples of one source that `RULE` names, for the page's 3-D view, as plain JSON values.

    Each holds its ``scene`` (:func:`gpca.page.scenes.packed_registration`), the object, the state, the error of the
    registration that is shown; in % of the object's diameter ``limit``, from which the mean error is a failure, the
    share φ of each concept in it, and under every subset of the causes, from none to all, what is taken out and the
    mean error.

    Args:
        files: the ``objects`` of the source, and the ``causes`` of its first seed.
        source: its ``title``, and whether it is a ``stand_in``.
        settings: those that the causes were drawn with.

    Raises:
        InputError: an unusable file, or one of other settings.
    """
    causes = Causes.load(files["causes"])
    rows = first_of_each_cause(causes)
    if not rows:
        return []
    objects = ObjectClouds.load(files["objects"])
    name, seed = Path(files["causes"]).parent.name, seed_of_file(files["causes"])
    registrations, truth = causes.registrations, causes.truth
    reach, samples = settings.icp.correspondence_distance, []
    for row in rows:
        observed_8 = replay(objects, causes, row, name, seed, settings).observed
        samples.append(
            {
                "object": str(registrations.object_name[row]),
                "sample": int(registrations.sample[row]),
                "concept": str(truth.dominant[row]),
                "state": str(truth.state[row]),
                "source": dict(source),
                "error_percent": _percent(causes.error_shown[row]),
                "limit": _percent(truth.failed_limit),
                "shares": [
                    {"concept": concept, "percent": _percent(truth.phi[row, i])} for i, concept in enumerate(CONCEPTS)
                ],
                "what_ifs": [
                    {"words": taken_out(subset), "percent": _percent(truth.error[row, subset])} for subset in BY_SIZE
                ],
                "scene": packed_registration(registrations, row, reach, observed_8),
            }
        )
    return samples


def first_of_each_cause(causes: Causes) -> list[int]:
    """Return the rows that `RULE` names, concept by concept."""
    registrations, truth = causes.registrations, causes.truth
    failed = np.flatnonzero((registrations.split == "test") & (truth.state == FAILED))
    in_order = failed[np.argsort(registrations.sample[failed], kind="stable")]
    return [int(row) for concept in CONCEPTS for row in in_order[truth.dominant[in_order] == concept][:1]]


def _percent(share: float) -> float:
    return round(100 * float(share), 2)
