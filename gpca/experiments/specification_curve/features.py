"""The classic features of Sec. IV-D, all of them or some."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.experiments.specification_curve.judged import accuracies
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.explainers.analytical_features import analytical_features
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

# Columns of the features: the residual first, the ratio of the point counts last.
COLUMNS = {
    "all": slice(None),
    "no_counts": slice(None, -1),
    "no_residual": slice(1, None),
    "residual": slice(0, 1),
    "counts": slice(-1, None),
}


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the paper's GPC on each choice of features."""
    for (source, seed), path in run_files.registrations.items():
        registrations = Registrations.load(path, (source, seed))
        features_S_F = analytical_features(registrations, source, seed, "analytical")
        train, test = (registrations.rows(split) for split in ("train", "test"))
        for reading in readings:
            chosen_S_F = features_S_F[:, COLUMNS[reading["features"]]]
            gpc = GPC(CONCEPTS, GPCSettings(**run_files.section("gpca_paper")), source, seed)
            gpc.fit(chosen_S_F[train], registrations.concept[train])
            scores_S_C, _, _ = gpc.attribute(chosen_S_F[test])
            for (metric, concept), value in accuracies(registrations.concept[test], scores_S_C).items():
                yield reading, source, "analytical_gpc", metric, concept, seed, value
