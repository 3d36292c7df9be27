"""An oracle that errs: some of its answers name another concept than the true one."""

from __future__ import annotations

import numpy as np

from gpca.seeds import generator


def answers(concept_N: np.ndarray, classes: tuple[str, ...], share: float, *axes: object) -> np.ndarray:
    """Return what it says of N samples.

    Which samples it errs about, and what it says of them, is drawn once for all shares: an oracle that errs more often
    repeats the errors of a better one, so that the two differ in nothing else.

    Args:
        concept_N: the truth.
        classes: what it may say.
        share: of the N samples, of which a wrong concept is named.
        axes: names of the draw.
    """
    random = generator(*axes, "oracle")
    order = random.permutation(len(concept_N))
    steps_N = random.integers(1, len(classes), size=len(concept_N))
    wrong = order[: round(share * len(concept_N))]
    said_N = np.array([classes.index(concept) for concept in concept_N], int)
    said_N[wrong] = (said_N[wrong] + steps_N[wrong]) % len(classes)
    return np.array(classes)[said_N]
