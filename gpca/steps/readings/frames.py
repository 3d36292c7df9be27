"""Table VI under other readings: what varies between repeats, and other rows.

The run has the predictions of encoders as published and of ICP from estimators' poses (``real_world.published`` and
``conditions`` of the config).
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.evaluation.measures import ALL
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator
from gpca.steps.readings.files import Row, RunFiles, accuracies_of_named
from gpca.steps.readings.groups import Reading


def repeats(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of every backbone and reduction, repeat by repeat, and how concepts are confused.

    A draw of training samples is with replacement, of as many as there are (Efron 1979).
    """
    by_seed = {seed: registrations for _, seed, registrations in run_files.loaded()}
    first, methods = next(iter(by_seed)), list(dict.fromkeys(method for _, method, _ in run_files.predictions))
    source = next(iter(run_files.registrations))[0]
    for varied in dict.fromkeys(reading["repeats"] for reading in readings):
        wanted = [reading for reading in readings if reading["repeats"] == varied]
        for method in progress(methods, f"repeats on depth frames: {varied}"):
            for seed, samples in by_seed.items():
                if varied == "everything":
                    named_S = run_files.predicted(source, method, seed)
                else:
                    samples = run_files.embedded(source, method, first)
                    rows = samples.rows("train")
                    if varied == "samples":
                        rows = generator(source, seed, "drawn samples").choice(rows, len(rows))
                    gpc = GPC(CONCEPTS, GPCSettings(**run_files.section("gpca")), source, seed, "repeat")
                    gpc.fit(samples.embedding[rows], samples.concept[rows])
                    named_S = _named(gpc.attribute(samples.embedding[samples.rows("test")])[0])
                yield from _rows(wanted, samples, named_S, source, method, seed)


def other_rows(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of the judged rows, or of others in their place, which the run may lack.

    The encoders of the others are as published, or their ICP starts at estimators' poses.
    """
    shown = {(source, seed): registrations for source, seed, registrations in run_files.loaded()}
    frames, published = run_files.section("frames"), run_files.section("published")
    for method in frames["methods"]:
        encoder, reduction = method.split("-")
        as_published = f"{published.get(encoder)}-{reduction}"
        for reading in readings:
            wanted = (
                frames["estimated" if reading.get("initial_pose") == "estimated" else "source"],
                as_published if reading.get("architecture") == "published" else method,
            )
            for source, name, seed in run_files.predictions:
                if (source, name) == wanted:
                    named_S = run_files.predicted(source, name, seed)
                    yield from _rows([reading], shown[source, seed], named_S, frames["source"], method, seed)


def _named(scores_S_C: np.ndarray) -> np.ndarray:
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]


def _rows(
    readings: Iterable[Reading], samples: Registrations, named_S: np.ndarray, source: str, method: str, seed: int
) -> Iterator[Row]:
    """Accuracies on the test samples that show the objects of each reading, and how often pose errors and missing
    overlap are taken for each other."""
    train, test = (samples.rows(split) for split in ("train", "test"))
    seen_S = np.isin(samples.object_name[test], samples.object_name[train])
    shown = {"all": np.ones(len(test), bool), "seen": seen_S, "unseen": ~seen_S}
    for reading in (reading for reading in readings if shown[reading["objects"]].any()):
        chosen_S = shown[reading["objects"]]
        true_n, named_n = samples.concept[test][chosen_S], named_S[chosen_S]
        values = accuracies_of_named(true_n, named_n)
        for concept, other in (("pose", "overlap"), ("overlap", "pose")):
            values["test_samples", concept] = float((true_n == concept).sum())
            values[f"predicted_as_{other}", concept] = float((named_n[true_n == concept] == other).sum())
        yield reading, source, method, seed, values | {("test_samples", ALL): float(len(true_n))}
