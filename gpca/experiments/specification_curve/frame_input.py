"""Table VI with other clouds before the encoder: as they were before ICP, or aligned by ICP from the model to them.

For each, rules train an encoder as that of the protocol is trained: pretrained on all sources, then on the frames of
each seed. That of the aligned source is the protocol's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.experiments.specification_curve.frames import of_objects, values
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import ALIGNED, Reading, ReadingSizes
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the backbone whose predictions are given, and how it confuses concepts.

    Of the embeddings, ``{backbone}-{cloud}`` are those of its encoder that sees another cloud.
    """
    for source, method, seed in run_files.predictions:
        shown = Registrations.load(run_files.registrations[source, seed], (source, seed))
        true_S = shown.concept[shown.rows("test")]
        for cloud in dict.fromkeys(reading["input"] for reading in readings):
            if cloud == ALIGNED:
                rows = read_predictions(run_files.predictions[source, method, seed])
                named_S = rows.loc[rows["split"] == "test", "concept_predicted"].to_numpy()
            else:
                named_S = named(run_files, source, f"{method.split('-')[0]}-{cloud}", seed)
            for reading in (reading for reading in readings if reading["input"] == cloud):
                chosen_S = of_objects(shown, reading["objects"])
                if chosen_S.any():
                    for (metric, concept), value in values(true_S[chosen_S], named_S[chosen_S]).items():
                        yield reading, source, method, metric, concept, seed, value


def named(run_files: RunFiles, source: str, embedded: str, seed: int) -> np.ndarray:
    """Return the concepts (S,) that GP-CA names for test samples, from embeddings of that name.

    Raises:
        InputError: there are no such embeddings.
    """
    if (source, embedded, seed) not in run_files.embeddings:
        raise InputError("readings of frame_input", f"lack embeddings {embedded} of {source}, seed {seed}", "give them")
    shown = run_files.embedded(source, embedded, seed)
    train, test = (shown.subset(shown.rows(split)) for split in ("train", "test"))
    gpc = GPC(CONCEPTS, GPCSettings(**run_files.section("gpca")), source, seed)
    scores_S_C, _, _ = gpc.fit(train.embedding, train.concept).attribute(test.embedding)
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]
