"""The steps of causes on scans: measured causes of registrations, and what explainers answer.

An explainer has learned from objects and is asked unchanged, or from scans: of all scenes outside the fold that it is
asked about. Encoders of the aligned source are those of objects in both cases: the classifier of their embeddings is
what learns from scans.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.alignment.methods.registry import make_method
from gpca.attribution.predictions import prediction_frame
from gpca.causes.dataset import LABELS, Causes, labeled, observed_only
from gpca.causes.descriptors import Descriptors, describe_all
from gpca.causes.scans import GLOBAL, LADDER, ScanStart, measure_scans, motion_between
from gpca.causes.settings import OBJECTS, OBSERVED, CauseSettings, DescriptorSettings, ScanSamples
from gpca.causes.truth import BORDERLINE
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.explainers.interface import REENACTED
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.reenactment.scans import reenact_scans
from gpca.reenactment.settings import ReenactmentSettings
from gpca.rigid import scale_translation
from gpca.scans.pair import Rung, ScanPair, ScanSuccess, disturbed
from gpca.scans.scene import ScanPairs
from gpca.seeds import generator
from gpca.settings import fields_of, read_settings
from gpca.steps.diagnosis import DESCRIBED, EMBEDDED, World
from gpca.steps.scan_trials import TrialSettings, pair_to_register
from gpca.steps.scans import drawn_pairs

if TYPE_CHECKING:
    import pandas as pd

FEWEST_LABELS = 2  # among the samples that an explainer learns from
GlobalMethod = Callable[[ScanPair], np.ndarray | None]  # returns T_target_source (4×4), meters; None where it fails


def measure(job: Job) -> None:
    """Draw pairs and starts, measure what made the registrations fail, describe and re-enact them."""
    own = read_settings(ScanSamples, job.section("samples"))
    outputs = [job.scan_causes, job.samples, job.descriptors, job.reenactments]
    with record_provenance(outputs, job.get("data", []), job.settings, seed=job.seed):
        axes, section = (job.source, job.seed), job.section("scans")
        chosen = drawn_pairs(job, section | {"pairs": own.pairs})
        kept = np.sort(generator(*axes, "scan causes", "pairs").permutation(len(chosen))[: own.most_pairs])
        pairs = ScanPairs.of([chosen[k] for k in kept])
        # Counterfactuals are registered as those of objects, but the source onto the target.
        icp = {name: getattr(own.icp, name) for name in ("correspondence_distance", "max_iterations")}
        truth = CauseSettings.from_dict(job.section("causes") | {"moved": OBSERVED}, icp)
        trials = read_settings(TrialSettings, fields_of(section, TrialSettings))
        methods = global_methods(trials, job.section("methods"), *axes) if own.global_start else {}
        starts = starts_of(pairs, *axes, own, trials.ladder, methods)
        success = read_settings(ScanSuccess, section.get("success") or {})
        causes, samples = measure_scans(pairs, starts, *axes, truth, success, own.points)
        causes.save(job.scan_causes)
        write_csv(job.samples, samples)
        descriptors = DescriptorSettings(**job.section("descriptors"))
        describe_all(causes, *axes, descriptors, truth.icp)[0].save(job.descriptors)
        T_found_S = []  # motions (k, 4, 4) from the start of each registration to the results of global methods
        for start in (starts[number] for number in samples["sample"]):
            motions = [motion_between(pairs[start.pair], start.T_target_source, found) for found in start.found]
            T_found_S.append(np.array(motions).reshape(-1, 4, 4))
        reenactment = read_settings(ReenactmentSettings, job.section("reenactment"))
        reenact_scans(causes, samples["error_factor"].to_numpy(), reenactment, truth, T_found_S).save(job.reenactments)


def global_methods(
    settings: TrialSettings, methods: Mapping[str, Mapping | None], *axes: object
) -> dict[str, GlobalMethod]:
    """The global method at whose pose local ones start, as Table XVII runs it, given settings by name."""
    name = settings.global_start
    align = make_method(name, methods.get(name))

    def register(pair: ScanPair) -> np.ndarray | None:
        outcome = align(pair_to_register(pair, settings.ladder[0], settings, *axes))
        return scale_translation(outcome.T_target_source, pair.scale) if outcome.converged else None

    return {name: register}


def starts_of(
    pairs: ScanPairs,
    source: str,
    seed: int,
    settings: ScanSamples,
    ladder: Sequence[Rung],
    methods: Mapping[str, GlobalMethod],
) -> list[ScanStart]:
    """Starts of each pair: drawn rungs, the poses of global methods, and a rung with noise added.

    A rung without an error is not drawn, because it would show that there is no pose error.
    """
    rungs = [rung for rung in ladder if rung.rotation_deg or rung.translation_m]
    starts: list[ScanStart] = []
    for k, pair in enumerate(pairs):
        order = generator(source, seed, "scan causes", pair.name, "rungs").permutation(len(rungs))
        drawn = [rungs[row] for row in order[: settings.ladder_starts]]
        poses = {rung.name: disturbed(pair, rung, source, seed) for rung in drawn}
        results = {name: register(pair) for name, register in methods.items()}
        known = {name: pose for name, pose in results.items() if pose is not None}
        found = tuple(known.values())
        starts += [ScanStart(k, LADDER, name, pose, found=found) for name, pose in poses.items()]
        starts += [ScanStart(k, GLOBAL, name, pose, found=found) for name, pose in known.items()]
        if settings.times and drawn:
            times = settings.times[k % len(settings.times)]
            starts.append(ScanStart(k, LADDER, drawn[0].name, poses[drawn[0].name], times, found))
    return starts


def diagnose(job: Job) -> None:
    """Ask every explainer about the registrations of all data sets of scans."""
    import pandas as pd

    scans = [job.scan_causes, job.scan_descriptors, job.scan_reenactments]
    # Files of each source; re-enactments only where an explainer reads them.
    training = {name: job.get(name, []) for name in ("causes", DESCRIBED, REENACTED, "encoders", EMBEDDED)}
    inputs = [path for files in (*scans, *training.values()) for path in files]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        explained = ScansToExplain(job, training)
        frames: list[pd.DataFrame] = []
        for name, learned_from in job.section("explainers").items():
            for learned in learned_from:
                attribution = explained.attribution(name, learned, job.section("settings").get(name) or {})
                if attribution is None:
                    fault = "is left out: what it would learn from has fewer than two labels"
                    print(f"explainer '{name}', learned from {learned}, {fault}", file=sys.stderr)
                    continue
                frames.append(explained.predictions(attribution).assign(learned=learned, explainer=name))
        if not frames:
            remedy = "raise scan_causes.pairs, or let an explainer learn from objects"
            raise InputError("predictions of scans", "no explainer has anything to learn from", remedy)
        write_csv(job.predictions, pd.concat(frames))


def folds_of(cluster_S: np.ndarray, most: int) -> np.ndarray:
    """Fold (S,) of each row; clusters are divided into folds, `most` at most."""
    clusters, number_S = np.unique(cluster_S, return_inverse=True)
    return number_S % min(most, len(clusters))


class ScansToExplain(World):
    """Registrations of scans to be explained, given the files of all sources of objects, by what explainers read.

    See :class:`gpca.steps.diagnosis.World`.
    """

    def __init__(self, job: Job, training: dict[str, list[Path]]) -> None:
        self._names, self._own, parts = [path.parent.name for path in job.scan_causes], [], []
        for paths in zip(job.scan_causes, job.scan_descriptors, job.scan_reenactments, strict=True):
            causes = Causes.load(paths[0])
            enacted, with_labels = Reenactments.load(paths[2], causes.registrations), labeled(causes)
            read = dict(Descriptors.load(paths[1], causes.registrations).groups)
            read |= {"verdict": enacted.verdict, "reenactment": reenactment_features(enacted)}
            self._own.append(causes.registrations)
            parts.append(replace(with_labels, attached={**with_labels.attached, **read}))
        self._all_read = Registrations.joined(parts)
        labels_alone = replace(self._all_read, attached={"causes": self._all_read.attached["causes"]})
        super().__init__(job, training, labels_alone, job.section("causes")["starts"])
        self._fold_S = folds_of(labels_alone.cluster, read_settings(ScanSamples, job.section("samples")).folds)

    def predictions(self, attribution: Attribution) -> pd.DataFrame:
        """Rows of a prediction file, the data set of each in column ``scans``."""
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
        """Mean of the scores over all that the explainer reads; several are the encoders of embeddings.

        None where it would have to learn from fewer than two classes.
        """
        entry = explainer_entry(name, CAUSES)
        attributions: list[Attribution] = []
        for training_set, asked in self._sets(entry, learned == OBJECTS):
            parts = [(np.arange(len(asked)), training_set)]
            if training_set is asked:  # one fold is asked about, and the labeled rows of the others are learned from
                labeled_S = asked.concept != BORDERLINE
                of_folds = (self._fold_S == fold for fold in np.unique(self._fold_S))
                parts = [(np.flatnonzero(of_S), asked.subset(np.flatnonzero(labeled_S & ~of_S))) for of_S in of_folds]
            answers = []
            for rows, training in parts:
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
