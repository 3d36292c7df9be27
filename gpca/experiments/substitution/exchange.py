"""Every explainer with each registration method, or each estimator of uncertainty, beneath it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import scale_translation, transform
from gpca.attribution.predictions import prediction_frame
from gpca.attribution.scores import Attribution
from gpca.experiments.controls.rivals import Embed, Rival, described_for
from gpca.experiments.substitution.estimated import OBSERVED, Estimates, KnobbedRegistrar
from gpca.experiments.substitution.settings import ESTIMATOR, FAILURE, LABELS, METHOD, ExchangeSettings
from gpca.io.files import SPLITS
from gpca.pairs.dataset import Registrations, ragged
from gpca.pairs.judge import Judges
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.steps.registration_trials import pair_to_register
from gpca.uncertainty.designs import ADDITIVE_KNOBS
from gpca.uncertainty.estimators.registry import make_estimator
from gpca.uncertainty.settings import UncertaintySettings

if TYPE_CHECKING:
    import pandas as pd

UNTAUGHT = "too few training registrations have an estimate"


@dataclass(frozen=True)
class Exchange:
    """The methods and estimators exchanged beneath the explainers of one source and seed.

    Attributes:
        source, seed: they name the random numbers.
        settings: those of the exchange.
        methods, estimators: name -> settings.
        uncertainty: floor, points and spread of the starts, of the estimators.
        rivals: by name. Those that read an uncertainty get each estimator's, the others each method's registrations.
        embed: registrations and the name of their source -> embeddings and head's logits by the run's encoder.
    """

    source: str
    seed: int
    settings: ExchangeSettings
    methods: Mapping[str, Mapping]
    estimators: Mapping[str, Mapping]
    uncertainty: UncertaintySettings
    rivals: Mapping[str, Rival]
    embed: Embed

    def run(self, registrations: Registrations, judges: Judges) -> pd.DataFrame:
        """Return a row for each explainer, test sample, and method or estimator beneath it.

        Args:
            registrations: those of the source, by the paper's protocol.
            judges: of their objects.

        Returns:
            the columns of a prediction file after `LABELS`, and `FAILURE`. Of methods, ``learnt_from`` and ``asked_of``
            are that of the training and that of the test registrations; of estimators they are the same.
        """
        import pandas as pd

        of_estimators = {name: rival for name, rival in self.rivals.items() if rival.reads.startswith("uncertainty/")}
        of_methods = {name: rival for name, rival in self.rivals.items() if name not in of_estimators}
        frames = list(self._by_methods(registrations, of_methods)) if of_methods else []
        if of_estimators:
            frames += self._by_estimators(registrations, of_estimators, judges)
        return pd.concat(frames, ignore_index=True)

    def _by_methods(self, registrations: Registrations, rivals: Mapping[str, Rival]) -> Iterator[pd.DataFrame]:
        settings = self.settings
        rows = np.concatenate(
            [first(registrations, "train", settings.train), first(registrations, "test", settings.test)]
        )
        registered = {}
        axes = self.source, self.seed, settings.points
        for name, (anew, failure_S) in registered_by(registrations.subset(rows), self.methods, *axes).items():
            h_S_d, logits_S_C = self.embed(anew, self.source)
            seen = replace(anew, attached={"embedding": h_S_d, "head_logits": logits_S_C})
            registered[name] = described_for(rivals, seen), failure_S
        for learnt_from, (learned, _) in registered.items():
            for explainer_name, rival in rivals.items():
                explainer = rival.make()
                explainer.fit(learned.subset(learned.rows("train")))
                for asked_of, (tested, failure_S) in registered.items():
                    test = tested.subset(tested.rows("test"))
                    attribution = explainer.explain(test.without_labels())
                    labels = METHOD, learnt_from, asked_of, explainer_name
                    yield labeled(prediction_frame(test, attribution), labels, failure_S[tested.rows("test")])

    def _by_estimators(
        self, registrations: Registrations, rivals: Mapping[str, Rival], judges: Judges
    ) -> Iterator[pd.DataFrame]:
        settings = self.settings
        learned = first(registrations, "train", 2 * settings.estimated_train)
        half = len(learned) // 2 // len(CONCEPTS) * len(CONCEPTS)  # threes of one object stay together
        test = first(registrations, "test", settings.estimated_test)
        described = described_for(rivals, registrations.subset(np.concatenate([learned[:half], test])))
        rows_of = {split: described.rows(split) for split in SPLITS}
        examples = KnobbedRegistrar(registrations, self.source, self.seed, self.uncertainty).examples(
            learned[half:], judges
        )
        estimators = {name: make_estimator(name, entry, examples) for name, entry in self.estimators.items()}
        registrar = KnobbedRegistrar(described.without_labels(), self.source, self.seed, self.uncertainty)
        lessons = rows_of["train"] if any(rival.observed_only for rival in rivals.values()) else np.arange(0)
        estimates_of_train = registrar.estimates(lessons, estimators, OBSERVED)
        estimates_of_test = registrar.estimates(rows_of["test"], estimators)
        train, test_samples = (described.subset(rows) for rows in rows_of.values())
        for estimator in estimators:
            for name, rival in rivals.items():
                attribution, failure_S = self._attributed(
                    rival, train, estimates_of_train[estimator], test_samples, estimates_of_test[estimator]
                )
                frame = prediction_frame(test_samples, attribution)
                yield labeled(frame, (ESTIMATOR, estimator, estimator, name), failure_S)

    def _attributed(
        self,
        rival: Rival,
        train: Registrations,
        estimates_of_train: Estimates,
        test: Registrations,
        estimates_of_test: Estimates,
    ) -> tuple[Attribution, np.ndarray]:
        """Return the attribution of all test samples, abstained where there is no estimate, and why there is none."""
        floor, conditions = self.uncertainty.floor, len(OBSERVED if rival.observed_only else ADDITIVE_KNOBS)
        explainer = rival.make()
        failure_S = estimates_of_test.why_untold(conditions)
        if rival.observed_only:
            known = np.flatnonzero(estimates_of_train.why_untold(len(OBSERVED)) == "")
            if set(train.concept[known]) < set(CONCEPTS):
                failure_S = np.where(failure_S == "", UNTAUGHT, failure_S)
            else:
                explainer.fit(estimates_of_train.attach_to(train, known, len(OBSERVED), floor))
        estimated = np.flatnonzero(failure_S == "")
        scores_S_C = np.zeros((len(test), len(CONCEPTS)))
        abstained_S = np.ones(len(test), bool)
        if len(estimated):
            attribution = explainer.explain(
                estimates_of_test.attach_to(test.without_labels(), estimated, conditions, floor)
            )
            scores_S_C[estimated], abstained_S[estimated] = attribution.scores_N_C, attribution.abstained_N
        return Attribution.of_scores(CONCEPTS, scores_S_C, seconds=0.0, abstained_N=abstained_S), failure_S


def first(registrations: Registrations, split: str, samples: int) -> np.ndarray:
    """Return the rows of the first `samples` of a split: threes of one object, which go round the objects."""
    return np.flatnonzero((registrations.split == split) & (registrations.sample < samples))


def labeled(frame: pd.DataFrame, labels: tuple[str, ...], failure_S: np.ndarray) -> pd.DataFrame:
    """Return a prediction file's columns between `LABELS` and `FAILURE`."""
    for place, (name, label) in enumerate(zip(LABELS, labels, strict=True)):
        frame.insert(place, name, label)
    frame[FAILURE] = failure_S
    return frame


def registered_by(
    registrations: Registrations, methods: Mapping[str, Mapping], source: str, seed: int, points: int
) -> dict[str, tuple[Registrations, np.ndarray]]:
    """Return for each method the registrations as it makes them, and why each failed (S,), empty if it did not.

    All methods get the same thinned clouds and the initial pose, which global ones do not read. The whole observed
    cloud moves to the pose that was found; a registration that failed stays where the method left it, and counts.

    Raises:
        InputError: an unknown method or setting, or a missing package.
    """
    made = {name: make_method(name, entry) for name, entry in methods.items()}
    outcomes: dict[str, list] = {name: [] for name in made}
    for row in progress(range(len(registrations)), f"registrations by other methods of {source}, seed {seed}"):
        pair = pair_to_register(registrations, row, source, seed, points)
        for name, method in made.items():
            outcomes[name].append(method(pair))
    targets = [registrations.target(row) for row in range(len(registrations))]
    by_method = {}
    for name, of_method in outcomes.items():
        clouds = [
            transform(outcome.T_target_source, registrations.source(row)).astype(np.float32)
            for row, outcome in enumerate(of_method)
        ]
        moved: dict[str, Any] = ragged(clouds, targets)
        poses = zip((outcome.T_target_source for outcome in of_method), registrations.diameter_m, strict=True)
        anew = replace(
            registrations,
            **moved,
            T_target_source_icp=np.array([scale_translation(T, diameter_m) for T, diameter_m in poses]),
            fitness=np.array([outcome.fitness for outcome in of_method]),
            inlier_rmse=np.array([outcome.inlier_rmse for outcome in of_method]),
            attached={},
        )
        by_method[name] = anew, np.array([outcome.failure for outcome in of_method])
    return by_method
