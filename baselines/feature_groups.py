"""What each part of a registration is worth to a cause's explainer: two learners, each on more and more of it.

Parts are added in the order of their cost. The runs from other starts and the remedies without a restart take as many
runs of ICP with the default settings, so that these two compare at the same price.
"""

from __future__ import annotations

from collections.abc import Callable

from baselines.descriptor_gpca import CausePairGPCA
from baselines.descriptors import ALL, CLOUDS, WITH_RUNS, DescriptorClassifier, entry, randomized_trees
from gpca.explainers.interface import ConceptExplainer
from gpca.explainers.sight import Sees, in_words
from gpca.settings import Count

LEVELS: dict[str, Sees] = {
    "source": ("source",),
    "pair": CLOUDS,
    "motion": ("pair", "motion"),
    "runs": WITH_RUNS,
    "quick_remedies": ("pair", "motion", "quick_remedies"),
    "everything": ALL,
}


def trees(sees: Sees, source: str, seed: int, trees: Count = 300, smallest_leaf: Count = 2) -> DescriptorClassifier:
    """Make a forest of extremely randomized trees on all descriptors of some parts."""
    return DescriptorClassifier(randomized_trees(source, seed, trees, smallest_leaf), sees)


Make = Callable[..., ConceptExplainer]
LEARNERS: dict[str, tuple[str, Make]] = {"trees": ("Forest", trees), "gpca": ("GP-CA's classifier", CausePairGPCA)}
CAUSE_EXPLAINERS = {
    f"{name}_on_{level}": entry(f"{title} on {in_words(sees)}", make, sees)
    for name, (title, make) in LEARNERS.items()
    for level, sees in LEVELS.items()
}
