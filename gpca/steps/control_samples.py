"""Samples of the controls: registrations as each control changes them; encoders trained on them (``train_control``)."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.encoders.registry import OF_ANY_SIZE, EncoderSettings
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import unseen
from gpca.objects.surface import instance_of
from gpca.pairs.dataset import Registrations, ragged
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.settings import Bounds, Count, Distinct, read_settings, require_ascending

PAPER = "paper"  # the protocol itself, which every control is compared with
Control = Literal["density", "unseen_objects", "hard", "reversed", "label_noise_30", "shuffled", "transfer"]
CONTROLS: tuple[str, ...] = get_args(Control)
UNSEEN = "unseen_objects"
HARD = "hard"  # other samples, in which no state is perfect and the label is measured
HARD_REENACTMENTS = "hard_reenactments"  # their folder
RETRAINED = ("density", UNSEEN, HARD)  # have another encoder
OF_EVERY_SEED = (UNSEEN, HARD)  # with another encoder for every seed
WRONG_LABELS = {"label_noise_30": 0.3}  # share of the training labels
RELABELED = (*WRONG_LABELS, "shuffled")
TRANSFER = "transfer"
FEWEST_OBJECTS = 5  # instances; with fewer, too few objects are left to learn from
LABELS = ("control", "tested", "explainer")  # columns before those of a prediction file
CURVE = ("epoch", "learning_rate", "loss", "accuracy")  # of training
Points = Annotated[int, Bounds(minimum=32, maximum=65536)]


@dataclass(frozen=True)
class ControlSettings:
    """The controls, and their sizes."""

    controls: Distinct[Control] = ("density", "unseen_objects", "label_noise_30", "shuffled", "transfer")
    encoder_seeds: Count = 1  # the first so many of `seeds` train more encoders than those of `OF_EVERY_SEED`
    seeds: Count = 3  # the first so many of the run's
    draw_points: tuple[Points, Points] = (200, 512)  # range of a cloud's random number of points for matched density
    folds: Annotated[int, Bounds(minimum=2, maximum=5)] = 3  # of a source's objects, of which one is unseen
    hard_sources: Distinct[str] = ()  # that have hard samples

    def __post_init__(self) -> None:
        require_ascending("setting ", self, "draw_points")


def left_out(control: str, registrations: Registrations, settings: ControlSettings, backbone: str) -> str | None:
    """Reason why these registrations, or the backbone of their encoder, do not admit a control; None where they do."""
    if control == UNSEEN:
        objects = len({instance_of(name) for name in registrations.object_name.tolist()})
        if objects < FEWEST_OBJECTS:
            return f"it needs at least {FEWEST_OBJECTS} objects, but there are {objects}"
    if control == "density":
        fewest, least = int(np.diff(registrations.offsets).min()), settings.draw_points[0]
        if fewest < least:
            return f"its smallest draw has {least} points, but a cloud has only {fewest}"
        if backbone not in OF_ANY_SIZE:
            return f"backbone '{backbone}' accepts clouds of one size only"
    return None


def variant(
    control: str, registrations: Registrations, source: str, seed: int, settings: ControlSettings, icp: ICPSettings
) -> Registrations:
    """Samples under a control; controls of labels and transfer leave the registrations as they are."""
    if control == "density":
        return thinned(registrations, settings.draw_points, source, seed)
    if control == UNSEEN:
        return of_unseen_objects(registrations, settings.folds, source, seed)
    if control == "reversed":
        from gpca.pairs.synthesis import registered_backwards

        return registered_backwards(registrations, icp)
    return registrations


def thinned(registrations: Registrations, points: tuple[int, int], *axes: object) -> Registrations:
    """Return registrations with a random number of points of each source cloud, whatever its concept."""
    clouds, targets = [], []
    for row in range(len(registrations)):
        cloud = registrations.cloud(row)
        random = generator(*axes, "thinned", registrations.split[row], registrations.sample[row])
        count = min(int(random.integers(points[0], points[1] + 1)), len(cloud))
        clouds.append(cloud[np.sort(random.permutation(len(cloud))[:count])])
        targets.append(registrations.target(row))
    thin: dict[str, Any] = ragged(clouds, targets)
    return replace(registrations, **thin)


def of_unseen_objects(registrations: Registrations, folds: int, source: str, seed: int) -> Registrations:
    """Return training samples of most families, and as test samples all of the others: a fold, which the seed names."""
    is_unseen = unseen(registrations.fold, seed)
    if is_unseen is None:
        families = generator(source, "folds").permutation(np.unique(registrations.cluster))
        is_unseen = np.isin(registrations.cluster, families[seed % folds :: folds])
    train = np.flatnonzero(~is_unseen & (registrations.split == "train"))
    test = np.flatnonzero(is_unseen)
    chosen = registrations.subset(np.concatenate([train, test]))
    # Numbered anew, since the test samples come from both splits.
    split = np.repeat(["train", "test"], [len(train), len(test)])
    sample = np.concatenate([chosen.sample[: len(train)], np.arange(len(test))])
    return replace(chosen, split=split, sample=sample)


def relabeled(control: str, train: Registrations, *axes: object) -> Registrations:
    """Return training samples with the labels of a control: a share names another concept, or all are shuffled."""
    random = generator(*axes, "labels", control)
    concept = train.concept.copy()
    if control == "shuffled":
        for name in CONCEPTS:  # each gets every label equally often, or a cluster would keep a most frequent label
            rows = random.permutation(np.flatnonzero(train.concept == name))
            concept[rows] = np.resize(random.permutation(CONCEPTS), len(rows))
    else:
        rows = random.permutation(len(train))[: round(WRONG_LABELS[control] * len(train))]
        steps = random.integers(1, len(CONCEPTS), size=len(rows))
        numbers = np.array([CONCEPTS.index(name) for name in concept[rows]], int)
        concept[rows] = np.array(CONCEPTS)[(numbers + steps) % len(CONCEPTS)]
    return replace(train, concept=concept)


def encode(
    control: str,
    registrations: Registrations,
    source: str,
    seed: int,
    settings: ControlSettings,
    encoder: EncoderSettings,
    checkpoint: Path | None = None,
) -> tuple[dict[str, np.ndarray], list[dict[str, float]]]:
    """Return arrays of embeddings by an encoder that is trained under the control, and its curve."""
    from gpca.encoders.training import embed, train_encoder

    if control == "density":
        fewest, most = settings.draw_points
        encoder = replace(encoder, fewest_points=fewest, draw_points=most)
    if control not in ("density", HARD):
        registrations = of_unseen_objects(registrations, settings.folds, source, seed)
    name = f"{source} under {control}"
    model, curve = train_encoder(registrations, name, seed, encoder, checkpoint)
    h_S_d, logits_S_C = embed(model, registrations, name, seed, encoder)
    return {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}, curve


def train(job: Job) -> None:
    """Train, keeping a checkpoint, and embed every sample; none where the registrations do not admit the control."""
    import pandas as pd

    settings = read_settings(ControlSettings, job.section("controls"))
    encoder = EncoderSettings(**job.section("encoder"))
    checkpoint = job.embeddings.with_suffix(".checkpoint")
    [path] = job.files("registrations")
    with record_provenance([job.embeddings, job.curve], [path], job.settings, seed=job.seed):
        registrations = Registrations.load(path, job.axes)
        if why := left_out(job.control, registrations, settings, encoder.backbone):
            print(f"control '{job.control}' of {job.source} is skipped: {why}", file=sys.stderr)
            arrays: dict[str, np.ndarray] = {name: np.zeros((0, 1), np.float32) for name in ("h", "head_logits")}
            arrays |= {"sample": np.zeros(0, int), "split": np.zeros(0, "U5")}
            curve: list[dict] = []
        else:
            arrays, curve = encode(job.control, registrations, job.source, job.seed, settings, encoder, checkpoint)
        save_arrays(job.embeddings, arrays, registrations.axes)
        write_csv(job.curve, pd.DataFrame(curve, columns=list(CURVE)), form="%.6g")
        checkpoint.unlink(missing_ok=True)
