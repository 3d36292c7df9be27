"""Step ``diagnose_scans``: registrations of scans with measured causes -> explainers' predictions.

An explainer has learned from objects, and is asked as it then is, or from scans: of all scenes but those of the fold
that it is asked about. Encoders of the aligned source are those of objects in both cases: what is learned from scans is
the classifier of their embeddings.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS, Causes, labeled, observed_only
from gpca.causes.descriptors import Descriptors
from gpca.causes.truth import BORDERLINE
from gpca.errors import InputError
from gpca.experiments.scan_causes.settings import OBJECTS, ScanSamples
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.settings import read_settings
from gpca.steps.diagnosis import DESCRIBED, EMBEDDED, World

if TYPE_CHECKING:
    import pandas as pd

FEWEST_LABELS = 2  # among the samples that an explainer learns from


def run(job: Job) -> None:
    """Ask every explainer about the registrations of all data sets of scans."""
    import pandas as pd

    scans = [job.scan_causes, job.scan_descriptors, job.scan_reenactments]
    # Of each source; re-enactments only where an explainer reads them.
    lessons = {name: job.get(name, []) for name in ("causes", DESCRIBED, REENACTED, "encoders", EMBEDDED)}
    inputs = [path for files in (*scans, *lessons.values()) for path in files]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        explained = _ScansToExplain(job, lessons)
        said_of: list[pd.DataFrame] = []
        for name, learned_from in job.section("explainers").items():
            for learned in learned_from:
                attribution = explained.attribution(name, learned, job.section("settings").get(name) or {})
                if attribution is None:
                    fault = "is left out: what it would learn from has fewer than two labels"
                    print(f"explainer '{name}', learned from {learned}, {fault}", file=sys.stderr)
                    continue
                said_of.append(explained.predictions(attribution).assign(learned=learned, explainer=name))
        if not said_of:
            remedy = "raise scan_causes.pairs, or let an explainer learn from objects"
            raise InputError("predictions of scans", "no explainer has anything to learn from", remedy)
        write_csv(job.predictions, pd.concat(said_of))


def folds_of(cluster_S: np.ndarray, most: int) -> np.ndarray:
    """Deal the clusters into folds, at most so many, and return the fold (S,) of each row."""
    clusters, number_S = np.unique(cluster_S, return_inverse=True)
    return number_S % min(most, len(clusters))


class _ScansToExplain(World):
    """Registrations of scans to be explained; see :class:`gpca.steps.diagnosis.World`.

    Args:
        lessons: files of all sources of objects, by what explainers read.
    """

    def __init__(self, job: Job, lessons: dict[str, list[Path]]) -> None:
        files = zip(job.scan_causes, job.scan_descriptors, job.scan_reenactments, strict=True)
        parts = [_measured(*paths) for paths in files]
        self._names, self._own = [path.parent.name for path in job.scan_causes], [own for own, _ in parts]
        joined = Registrations.joined([with_labels for _, with_labels in parts])
        self._all_read = joined
        labels_alone = replace(joined, attached={"causes": joined.attached["causes"]})
        super().__init__(job, lessons, labels_alone, job.section("causes")["starts"])
        self._fold_S = folds_of(joined.cluster, read_settings(ScanSamples, job.section("samples")).folds)

    def predictions(self, attribution: Attribution) -> pd.DataFrame:
        """Return the rows of a prediction file, the data set of each in column ``scans``."""
        import pandas as pd

        frames, first = [], 0
        for name, own in zip(self._names, self._own, strict=True):
            rows = slice(first, first := first + len(own))
            of_own = Attribution.of_scores(
                LABELS,
                attribution.scores_N_C[rows],
                seconds=0.0,
                icp_calls=attribution.icp_calls_N[rows],
                abstained_N=attribution.abstained_N[rows],
            )
            frames.append(prediction_frame(own, of_own).assign(scans=name))
        return pd.concat(frames)

    def attribution(self, name: str, learned: str, settings: dict) -> Attribution | None:
        """Return the mean of the scores over all that the explainer reads; several are the encoders of embeddings.

        None where it would have to learn from fewer than two classes.
        """
        entry = explainer_entry(name, CAUSES)
        attributions: list[Attribution] = []
        for training_set, asked in self._sets(entry, learned == OBJECTS):
            answers = []
            for rows, training in self._parts(training_set, asked):
                if len(np.unique(training.concept)) < FEWEST_LABELS:
                    return None
                explainer = entry.make(*self._axes, **settings)
                explainer.fit(training)
                answers.append((rows, explainer.explain(observed_only(asked.subset(rows)))))
            order = np.argsort(np.concatenate([rows for rows, _ in answers]))
            scores_N_4 = np.concatenate([answer.scores_N_C for _, answer in answers])[order]
            abstained_N = np.concatenate([answer.abstained_N for _, answer in answers])[order]
            attributions.append(Attribution.of_scores(LABELS, scores_N_4, seconds=0.0, abstained_N=abstained_N))
        return self._mean(entry, attributions)

    def _read(self, reads: str) -> Registrations:
        return self._all_read

    def _parts(self, learned: Registrations, asked: Registrations) -> Iterator[tuple[np.ndarray, Registrations]]:
        """Yield rows that are asked about, and what is learned for them: objects, or the rows of other folds."""
        if learned is not asked:
            yield np.arange(len(asked)), learned
            return
        labeled_S = asked.concept != BORDERLINE
        for fold in np.unique(self._fold_S):
            taught = np.flatnonzero(labeled_S & (self._fold_S != fold))
            yield np.flatnonzero(self._fold_S == fold), asked.subset(taught)


def _measured(
    causes_file: Path, descriptors_file: Path, reenactments_file: Path
) -> tuple[Registrations, Registrations]:
    """Return the registrations of a data set, and the same with labels and all that explainers read but embeddings."""
    causes = Causes.load(causes_file)
    enacted = Reenactments.load(reenactments_file, causes.registrations)
    read = dict(Descriptors.load(descriptors_file, causes.registrations).groups)
    read |= {"verdict": enacted.verdict, "reenactment": reenactment_features(enacted)}
    with_labels = labeled(causes)
    return causes.registrations, replace(with_labels, attached={**with_labels.attached, **read})
