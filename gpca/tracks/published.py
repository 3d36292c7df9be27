"""What is shipped with each track: the truth of its test samples, predictions of the published methods, and hashes."""

import hashlib
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from gpca.causes.judged import SampleTruth
from gpca.causes.truth import Truth
from gpca.errors import InputError, refusing
from gpca.io.arrays import REAL, TEXT, WHOLE, load_arrays
from gpca.io.container import FLAG, Container, array
from gpca.io.files import require_file, require_memory, whole_file
from gpca.io.frame import Frame
from gpca.objects.source import DATA
from gpca.process.code_files import ROOT
from gpca.tracks.track import Track

FOLDER = ROOT / "results/leaderboard/published"
NO_CALLS = -1  # unknown number of ICP calls
NOTHING_NAMED = -1  # in the place of a label's number
LIMITS = ("nominal_limit", "failed_limit", "cause_limit")


def require_clone(subject: str) -> None:
    """Raise an InputError for a package installed without the repository's data."""
    if not DATA.is_dir():
        fault = "needs the data and the published predictions of the repository, which the installed package lacks"
        raise InputError(subject, fault, "install it from a clone with 'pip install -e'")


@dataclass(frozen=True)
class Rows(Container):
    """N test samples of a track, part by part, with their truth."""

    source: np.ndarray = array("N", TEXT)
    seed: np.ndarray = array("N", WHOLE)
    sample: np.ndarray = array("N", WHOLE)
    object: np.ndarray = array("N", TEXT)
    cluster: np.ndarray = array("N", TEXT)
    concept: np.ndarray = array("N", TEXT)
    symmetric: np.ndarray = array("N", FLAG)
    start: np.ndarray = array("N", TEXT)  # of depth frames: kind of start, its instance, dataset and scene
    instance: np.ndarray = array("N", WHOLE)
    scene: np.ndarray = array("N", TEXT)
    counted: np.ndarray = array("N", FLAG)  # in measures, unlike scenes with poses by ICP, and scans with added noise
    error: np.ndarray = array("N 8")
    uncertainty: np.ndarray = array("N 8")
    error_again: np.ndarray = array("N 8")  # from other starts
    uncertainty_again: np.ndarray = array("N 8")
    error_shown: np.ndarray = array("N")  # of the shown registration
    uncertainty_limit: np.ndarray = array("N")  # of nominal registrations, nats

    def parts(self) -> Iterator[tuple[str, int, np.ndarray]]:
        """Yield source, seed and row numbers of each part, in order."""
        keys = list(zip(self.source.tolist(), self.seed.tolist(), strict=True))
        for source, seed in dict.fromkeys(keys):
            yield source, seed, np.flatnonzero((self.source == source) & (self.seed == seed))


@dataclass(frozen=True)
class Method:
    """A method and its predictions for all rows."""

    name: str
    title: str
    reads: str  # its inputs, in words; empty where unknown
    icp_calls: int  # runs of ICP beyond the explained one, or `NO_CALLS`
    scores: np.ndarray  # (N, C) of the track's labels; NaN for sources without data
    named: np.ndarray  # (N,) number of the predicted label, or `NOTHING_NAMED`

    def labels_named(self, labels: tuple[str, ...]) -> np.ndarray:
        """Return the predicted labels (N,), empty for none."""
        return np.array([*labels, ""])[self.named]


def label_numbers(label_N: Iterable[str], labels: Sequence[str]) -> np.ndarray:
    """Return the number of each label (N,), or `NOTHING_NAMED`."""
    numbers = {label: number for number, label in enumerate(labels)}
    return np.array([numbers.get(label, NOTHING_NAMED) for label in label_N])


def predicted(rows: Frame, labels: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the scores (N, C) of rows of a prediction file, and the numbers (N,) of the predicted labels."""
    named_N = np.where(rows["abstained"], "", rows["concept_predicted"].to_numpy(str))
    return rows[[f"score_{label}" for label in labels]].to_numpy(float), label_numbers(named_N, labels)


@dataclass(frozen=True)
class Published:
    """All that is shipped with a track."""

    track: Track
    rows: Rows
    limits: Mapping[str, float]  # common limits of errors (:class:`gpca.causes.truth.Truth`)
    methods: tuple[Method, ...]
    hashes: Mapping[str, str]  # SHA-256 of the arrays of every file of samples, by its path below the folder of a run
    commit: str = ""  # of the run; empty where unknown

    @cached_property
    def version(self) -> str:
        """Identifier of the samples, from their hashes."""
        folder = self.track.samples.split("/")[0]
        text = "\n".join(f"{file} {of}" for file, of in sorted(self.hashes.items()) if file.split("/")[0] == folder)
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    def truth_of(self, rows: np.ndarray) -> SampleTruth:
        """Return the truth of rows of one part, given by their numbers."""
        part = self.rows.subset(rows)
        limits: dict[str, Any] = {**self.limits, "uncertainty_limit": float(part.uncertainty_limit[0])}
        truth = Truth(part.error, part.uncertainty, **limits)
        again = Truth(part.error_again, part.uncertainty_again, **limits)
        return SampleTruth(truth, again, part.cluster, part.symmetric, part.error_shown)

    def save(self, path: Path) -> None:
        """Write the npz; equal contents give equal bytes."""
        arrays = self.rows.arrays | {name: np.array(self.limits[name]) for name in LIMITS}
        arrays |= {f"method_{name}": np.array([getattr(each, name) for each in self.methods]) for name in _WORDS}
        arrays |= {name: np.stack([getattr(each, name) for each in self.methods]) for name in ("scores", "named")}
        files = sorted(self.hashes.items())
        arrays |= {"files": np.array([file for file, _ in files]), "sha256": np.array([of for _, of in files])}
        arrays |= {"commit": np.array(self.commit or "unknown")}
        with whole_file(path) as partial:
            np.savez_compressed(partial, allow_pickle=False, **arrays)

    @classmethod
    def load(cls, track: Track, path: Path | None = None) -> Self:
        """Read what is shipped with a track."""
        require_clone(f"track {track.name}")
        path = path or FOLDER / f"{track.name}.npz"
        if not path.is_file():
            remedy = f"restore it, or make it from a run: gpca ship-predictions --tracks {track.name}"
            raise InputError(path, "no such file, in which the published rows are", remedy)
        labels = len(track.labels)
        declared = Rows.array_fields()
        shapes = {name: each.shape for name, each in declared.items()} | dict.fromkeys(LIMITS, ())
        shapes |= {f"method_{name}": ("M",) for name in _WORDS} | {"scores": ("M", "N", labels), "named": ("M", "N")}
        shapes |= {"files": ("F",), "sha256": ("F",), "commit": ()}
        kinds = dict.fromkeys(shapes, TEXT) | {name: each.kind for name, each in declared.items()}
        kinds |= dict.fromkeys((*LIMITS, "scores"), REAL) | dict.fromkeys(("named", "method_icp_calls"), WHOLE)
        arrays = load_arrays(path, shapes, kinds)
        if not ((arrays["named"] >= NOTHING_NAMED) & (arrays["named"] < labels)).all():
            raise InputError(path, "names labels that the track does not have", "restore it")
        words = [arrays[f"method_{name}"].tolist() for name in _WORDS]
        methods = zip(*words, arrays["scores"], arrays["named"], strict=True)
        return cls(
            track=track,
            rows=Rows(axes=None, **{name: arrays[name] for name in declared}),
            limits={name: float(arrays[name]) for name in LIMITS},
            methods=tuple(Method(*each) for each in methods),
            hashes=dict(zip(arrays["files"].tolist(), arrays["sha256"].tolist(), strict=True)),
            commit="" if str(arrays["commit"]) == "unknown" else str(arrays["commit"]),
        )


_WORDS = ("name", "title", "reads", "icp_calls")


def sha256_of_arrays(path: str | Path) -> str:
    """Return the hexadecimal SHA-256 of the arrays of an npz, their names, types and shapes, however it is packed."""
    digest, remedy = hashlib.sha256(), "remove it; it is made anew"
    require_file(path, "no such file", remedy, np.inf)
    with refusing(path, "is not a readable npz archive", remedy):
        with zipfile.ZipFile(path) as archive:
            size = sum(info.file_size for info in archive.infolist())
        require_memory(size, Path(path).stat().st_size, path, remedy)
        with np.load(path, allow_pickle=False) as arrays:
            for name in sorted(arrays.files):
                array = np.ascontiguousarray(arrays[name])
                digest.update(f"{name}|{array.dtype.str}|{array.shape}|".encode())
                digest.update(array.tobytes())
    return digest.hexdigest()
