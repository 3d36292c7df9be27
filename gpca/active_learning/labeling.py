"""Labeling by a person: queued registrations, the file of labels, and the session that asks and retrains."""

import csv
import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from gpca.active_learning.acquisition import Pool, select
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError, refusing
from gpca.io.arrays import TEXT, WHOLE, write_arrays
from gpca.io.container import Container, array
from gpca.io.files import append_row, printable, require_file, whole_file
from gpca.pairs.dataset import ragged
from gpca.seeds import generator

LABEL_COLUMNS = ("sample", "split", "concept")
Key = tuple[str, int]  # split and number of a sample
SKIPPED = ""  # concept of a sample that the person skipped
QUEUE_MARK = "queued"  # array that tells a queue from the registrations of a run
LONGEST_NAME = 200  # characters
LARGEST_BYTES = 10**7  # of labels or answers


@dataclass(frozen=True)
class Queue(Container):
    """S registrations without labels, with clouds as in :class:`gpca.pairs.dataset.Registrations`."""

    remedy: ClassVar[str] = "queue the registrations again"

    object_name: np.ndarray = array("S", TEXT)  # of the files, as ``source to target``
    h: np.ndarray = array("S d")  # embeddings of the aligned sources
    points: np.ndarray = array("P 3", offsets="offsets")
    offsets: np.ndarray = array("S+1", WHOLE)
    target_points: np.ndarray = array("Q 3", offsets="target_offsets")
    target_offsets: np.ndarray = array("S+1", WHOLE)

    def cloud(self, i: int) -> np.ndarray:
        """Return the aligned source cloud (P, 3) of row i."""
        return self.part("points", i)

    def target(self, i: int) -> np.ndarray:
        """Return the target cloud (Q, 3) of row i."""
        return self.part("target_points", i)


def is_queue(path: str | Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return f"{QUEUE_MARK}.npy" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def require_queue(path: str | Path) -> None:
    if not is_queue(path):
        raise InputError(path, "is not a queue", "name another file with --queue")


def add_to_queue(path: str | Path, aligned: np.ndarray, target: np.ndarray, h_1_d: np.ndarray, name: str) -> int:
    """Append a registration to a file, which need not exist, and return the number of registrations in it.

    The clouds (N, 3) are in the target's canonical frame and diameters; `h_1_d` is the aligned source's embedding.
    """
    path = Path(path)
    one = Queue(
        object_name=np.array([" ".join(printable(name).split())[-LONGEST_NAME:]]),
        h=h_1_d.astype(np.float32),
        **ragged([aligned.astype(np.float32)], [target.astype(np.float32)]),
    )
    with whole_file(path) as partial:  # no other process adds to it meanwhile
        if path.exists():
            require_queue(path)
            before = Queue.load(path)
            if before.h.shape[1] != one.h.shape[1]:
                raise InputError(path, "is a queue of another model", "name another file with --queue")
            one = Queue.joined([before, one])
        write_arrays(partial, one.arrays | {QUEUE_MARK: np.array(1)})
    return len(one)


class LabelFile:
    """Labels of the given samples in a CSV, which need not exist; every answer is appended and written at once."""

    def __init__(self, path: str | Path, samples: Mapping[Key, object]) -> None:
        self.path = Path(path)
        self.labels: dict[Key, str] = {}
        if not self.path.exists() or (self.path.is_file() and not self.path.stat().st_size):
            return
        remedy = "correct or remove the line"
        require_file(self.path, "no such file", remedy, LARGEST_BYTES)
        with (
            refusing(self.path, "is not a readable CSV file ({})", remedy),
            self.path.open(newline="", encoding="utf-8-sig", errors="replace") as file,
        ):
            head, *rows = [*filter(None, csv.reader(file))] or [[*LABEL_COLUMNS]]
        if head != [*LABEL_COLUMNS]:
            raise InputError(self.path, f"has the columns {','.join(head)[:80]}", f"give {','.join(LABEL_COLUMNS)}")
        known = {(str(number), split): (split, number) for split, number in samples}
        for line, row in enumerate(rows, start=2):
            where = f"{self.path}, line {line}"
            if len(row) != len(LABEL_COLUMNS):
                raise InputError(where, f"has {len(row)} entries, not {len(LABEL_COLUMNS)}", remedy)
            sample, split, concept = row
            if (key := known.get((sample, split))) is None:
                raise InputError(where, f"no sample {sample[:40]!r} of split {split[:40]!r}", "remove the line")
            concept = concept.strip()
            if concept != SKIPPED:
                require_name(concept, where)
            if self.labels.get(key, concept) != concept:
                fault = f"'{concept}' contradicts the earlier '{self.labels[key]}'"
                raise InputError(where, fault, "remove one of them")
            self.labels[key] = concept

    def add(self, key: Key, concept: str) -> None:
        """Append one answer and write it to disk."""
        append_row(self.path, (key[1], key[0], concept), LABEL_COLUMNS)
        self.labels[key] = concept


def require_name(concept: str, subject: object = "concept") -> None:
    """Raise an InputError unless the concept can name a column: lowercase letters, digits and _."""
    if not re.fullmatch(r"[a-z_][a-z0-9_]{0,39}", concept):
        fault = f"'{concept[:40]}' is not a valid concept name"
        raise InputError(subject, fault, "use at most 40 lowercase letters, digits and _")


@dataclass(frozen=True)
class Question:
    """A sample to be labeled: its row, and the classifier's scores and variances (C,)."""

    row: int
    scores_C: np.ndarray
    variances_C: np.ndarray
    bald: float


class Session:
    """A growing set of labels and the classifier trained on them; new concepts extend its classes."""

    def __init__(
        self,
        h_S_d: np.ndarray,
        keys: list[Key],
        start: Mapping[Key, str],
        labels: LabelFile,
        settings: GPCSettings,
        strategy: str = "bald_kmeans",
        seed: int = 0,
        gpc: GPC | None = None,
    ) -> None:
        self.keys, self.labels, self.h_S_d = keys, labels, h_S_d
        self._strategy, self._random = strategy, generator("label", seed)
        self._rows = {key: row for row, key in enumerate(keys)}
        self._start = dict(start)
        self._earlier = [] if gpc is None else [gpc.learned_N_d]  # standardized inputs of earlier training
        if gpc is None:
            concepts = tuple(dict.fromkeys(start.values()))
            if len(concepts) < 2:
                raise InputError("labeling", "starts with fewer than two labeled concepts", "name two with --known")
            gpc = GPC(concepts, settings, "label", seed)
            gpc.fit(h_S_d[[self._rows[key] for key in start]], np.array(list(start.values())), h_S_d)
            gpc.refine()
        self.gpc = gpc
        self._learned: set[Key] = set()
        self.retrain()

    @property
    def answered(self) -> dict[Key, str]:
        """The answers that name a concept."""
        return {key: concept for key, concept in self.labels.labels.items() if concept != SKIPPED}

    def retrain(self) -> int:
        """Learn the answers since the last call, including new concepts, and return their number."""
        fresh = {key: concept for key, concept in self.answered.items() if key not in self._learned}
        for concept in dict.fromkeys(fresh.values()):
            if concept not in self.gpc.classes:
                self.gpc.grow(concept)
        if fresh:
            self.gpc.update(self.h_S_d[[self._rows[key] for key in fresh]], np.array(list(fresh.values())))
        self._learned |= set(fresh)
        return len(fresh)

    def ask(self, batch: int) -> list[Question]:
        """Return at most `batch` unlabeled training samples to label next; none if all are labeled."""
        judged = self._start.keys() | self.labels.labels.keys()
        left = [row for row, key in enumerate(self.keys) if key[0] == "train" and key not in judged]
        if not left:
            return []
        projection = self.gpc.project(self.h_S_d[left])
        scores_N_C, variances_N_C, bald_N = self.gpc.attribute(projection)
        labeled = [self._rows[key] for key in (*self._start, *self.answered)]
        inputs_L_d = [*self._earlier, *([self.gpc.project(self.h_S_d[labeled]).inputs_N_d] if labeled else [])]
        pool = Pool(projection.inputs_N_d, scores_N_C, bald_N, np.concatenate(inputs_L_d), np.full(len(left), ""))
        chosen = select(self._strategy, pool, batch, self._random)
        return [Question(left[i], scores_N_C[i], variances_N_C[i], float(bald_N[i])) for i in chosen]
