"""A person as the oracle: the labels that were given so far, the classifier that they make, and what to ask next."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.active_learning.acquisition import Pool, select
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.io.csv_file import read_csv
from gpca.numerals import whole
from gpca.seeds import generator

LABEL_COLUMNS = ("sample", "split", "concept")
Key = tuple[str, int]  # split and number of a sample
SKIPPED = ""  # stands in the file for a sample that the person did not want to judge


class LabelFile:
    """Labels in a CSV that is appended to, answer by answer, so that nothing is lost when labeling is stopped.

    Args:
        path: the file; it need not exist yet.
        known: the samples that there are.

    Raises:
        InputError: a missing column, an unknown sample, one with two different labels, a name that is no word.
    """

    def __init__(self, path: str | Path, known: Mapping[Key, object]) -> None:
        self.path = Path(path)
        self.labels: dict[Key, str] = {}
        written = self.path.read_text(encoding="utf-8", errors="replace").strip() if self.path.is_file() else ""
        if written in ("", ",".join(LABEL_COLUMNS)):
            return
        rows = read_csv(self.path, LABEL_COLUMNS, remedy="correct or remove the line")
        for line, (sample, split, concept) in enumerate(rows[list(LABEL_COLUMNS)].itertuples(index=False), start=2):
            where = f"{self.path}, line {line}"
            try:
                key = (split, whole(sample))
            except ValueError:
                key = (split, -1)
            if key not in known:
                raise InputError(where, f"no sample '{sample[:40]}' of split '{split}'", "remove the line")
            concept = concept.strip()
            if concept != SKIPPED:
                require_name(concept, where)
            if self.labels.get(key, concept) != concept:
                raise InputError(
                    where, f"'{concept}' contradicts the earlier '{self.labels[key]}'", "remove one of them"
                )
            self.labels[key] = concept

    def add(self, key: Key, concept: str) -> None:
        """Append one answer, on the disk before this returns."""
        new = not self.path.is_file() or self.path.stat().st_size == 0
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            if new:
                writer.writerow(LABEL_COLUMNS)
            writer.writerow((key[1], key[0], concept))
        self.labels[key] = concept


def require_name(concept: str, subject: object = "concept") -> None:
    """Raise an InputError unless the concept can be the name of a column: a word of small letters, digits and _."""
    if not concept:
        raise InputError(subject, "the concept has no name", "give one, e.g. 'occlusion'")
    if not (concept.isascii() and concept.isidentifier() and concept == concept.lower()):
        raise InputError(subject, f"'{concept}' is not a valid concept name", "use lowercase letters, digits and _")


@dataclass(frozen=True)
class Question:
    """A sample to be judged: its row, and the scores and variances (C,) that the classifier gives it."""

    row: int
    scores_C: np.ndarray
    variances_C: np.ndarray
    bald: float


class Session:
    """Labels that grow and the classifier that learns them; it meets new concepts by growing its label space.

    Args:
        h_S_d: embeddings of all samples.
        keys: split and number of each.
        start: labels that were known before the first question.
        labels: the file of answers; those that it holds are learned at once.
        settings: how the classifier is fitted.
        strategy: which one of :mod:`gpca.active_learning.acquisition` asks.
        gpc: a classifier that has learned already, and learns on; then `start` may be empty.

    Raises:
        InputError: fewer than two concepts are labeled.
    """

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
        self.keys = keys
        self.labels = labels
        self._strategy = strategy
        self._rows = {key: row for row, key in enumerate(keys)}
        self._random = generator("label", seed)
        self._start = dict(start)
        self.gpc = _fitted(h_S_d, [self._rows[key] for key in start], start, settings, seed) if gpc is None else gpc
        self._known = [] if gpc is None else [gpc.learned_N_d]  # standardized, what it learned before
        self.h_S_d = h_S_d
        self._learned: set[Key] = set()
        self.retrain()

    @property
    def answered(self) -> dict[Key, str]:
        """The answers that name a concept."""
        return {key: concept for key, concept in self.labels.labels.items() if concept != SKIPPED}

    def retrain(self) -> int:
        """Learn the answers given since the last call, new concepts included, and return their number."""
        fresh = {key: concept for key, concept in self.answered.items() if key not in self._learned}
        for concept in dict.fromkeys(fresh.values()):
            if concept not in self.gpc.classes:
                self.gpc.grow(concept)
        if fresh:
            self.gpc.update(self.h_S_d[[self._rows[key] for key in fresh]], np.array(list(fresh.values())))
        self._learned |= set(fresh)
        return len(fresh)

    def ask(self, batch: int) -> list[Question]:
        """Return the training samples that are worth a label now, at most `batch`, none when all are judged."""
        judged = self._start.keys() | self.labels.labels.keys()
        left = [row for row, key in enumerate(self.keys) if key[0] == "train" and key not in judged]
        if not left:
            return []
        projection = self.gpc.project(self.h_S_d[left])
        scores_N_C, variances_N_C, bald_N = self.gpc.attribute(projection)
        labeled = self.h_S_d[[self._rows[key] for key in (*self._start, *self.answered)]]
        inputs_L_d = [*self._known, *([self.gpc.project(labeled).inputs_N_d] if len(labeled) else [])]
        pool = Pool(projection.inputs_N_d, scores_N_C, bald_N, np.concatenate(inputs_L_d), np.full(len(left), ""))
        chosen = select(self._strategy, pool, batch, self._random)
        return [Question(left[i], scores_N_C[i], variances_N_C[i], float(bald_N[i])) for i in chosen]


def _fitted(h_S_d: np.ndarray, rows: list[int], start: Mapping[Key, str], settings: GPCSettings, seed: int) -> GPC:
    concepts = tuple(dict.fromkeys(start.values()))
    if len(concepts) < 2:
        raise InputError("labeling", "starts with fewer than two labeled concepts", "name two with --known")
    gpc = GPC(concepts, settings, "label", seed)
    gpc.fit(h_S_d[rows], np.array(list(start.values())), h_S_d)
    gpc.refine()
    return gpc
