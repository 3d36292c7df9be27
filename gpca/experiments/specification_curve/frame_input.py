"""Table VI with other clouds before the encoder: as they were before ICP, or aligned by ICP from the model to them.

For each an encoder is trained as that of the protocol is: pretrained on the training samples of all sources, then on
the frames of each seed. That of the aligned source is the protocol's own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_predictions
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.settings import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.errors import InputError
from gpca.experiments.specification_curve.frames import of_objects, values
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.frames.instances import read_instances_of
from gpca.io.names import Axes
from gpca.pairs.dataset import Registrations, joined
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.reading import read_as

ALIGNED = "aligned"


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the backbone whose predictions are given, and how it confuses concepts.

    The frames are of the source and the seeds that the predictions have; other registrations are for the pretraining.
    """
    source, method, _ = next(iter(run_files.predictions))
    for cloud in dict.fromkeys(reading["input"] for reading in readings):
        start = None if cloud == ALIGNED else pretrained(run_files, cloud, source)
        for of_source, _, seed in run_files.predictions:
            shown = Registrations.load(_frames(run_files, of_source, seed), (of_source, seed))
            if cloud == ALIGNED:
                rows = read_predictions(run_files.predictions[source, method, seed])
                named_S = rows.loc[rows["split"] == "test", "concept_predicted"].to_numpy()
            else:
                named_S = named(run_files, shown, cloud, start, source, seed)
            true_S = shown.concept[shown.rows("test")]
            for reading in (reading for reading in readings if reading["input"] == cloud):
                chosen_S = of_objects(shown, reading["objects"])
                if chosen_S.any():
                    for (metric, concept), value in values(true_S[chosen_S], named_S[chosen_S]).items():
                        yield reading, source, method, metric, concept, seed, value


def pretrained(run_files: RunFiles, cloud: str, frames: str) -> dict[str, torch.Tensor] | None:
    """Return the weights after training on all sources but the frames; None where the config has no pretraining."""
    parts = [(path, axes) for axes, path in run_files.registrations.items() if axes[0] != frames]
    if not parts or not run_files.section("pretraining"):
        return None
    seed = min(seed for source, seed in run_files.registrations if source != frames)
    settings = _settings(run_files, cloud, "pretraining")
    seen = read_as(cloud, joined([_train_samples(*part) for part in parts]), _icp(run_files))
    return train_encoder(seen, "pretraining", seed, settings)[0].state_dict()


def named(
    run_files: RunFiles, shown: Registrations, cloud: str, start: dict[str, torch.Tensor] | None, source: str, seed: int
) -> np.ndarray:
    """Return the concepts that GP-CA names for test samples (S,) of frames, with other clouds before the encoder."""
    settings = _settings(run_files, cloud, "training")
    instance_S = read_instances_of(run_files.poses[source, seed], shown)
    seen = read_as(cloud, shown, _icp(run_files))
    model, _ = train_encoder(seen, source, seed, settings, start=start, group_S=instance_S)
    embedded = replace(shown, attached={"embedding": embed(model, seen, source, seed, settings)[0]})
    train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
    gpc = GPC(CONCEPTS, GPCSettings(**run_files.section("gpca")), source, seed)
    scores_S_C, _, _ = gpc.fit(train.embedding, train.concept).attribute(test.embedding)
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]


def _train_samples(path: Path, axes: Axes) -> Registrations:
    whole = Registrations.load(path, axes)
    return whole.subset(whole.rows("train"))


def _settings(run_files: RunFiles, cloud: str, part: str) -> EncoderSettings:
    return EncoderSettings(**run_files.section("encoder") | run_files.section(part) | {"reading": cloud})


def _icp(run_files: RunFiles) -> ICPSettings:
    return ICPSettings(**run_files.section("icp"))


def _frames(run_files: RunFiles, source: str, seed: int) -> Path:
    if (source, seed) not in run_files.registrations or (source, seed) not in run_files.poses:
        fault = f"lack registrations or poses of {source}, seed {seed}, beside its predictions"
        raise InputError("readings of frame_input", fault, "give them")
    return run_files.registrations[source, seed]
