"""Step ``exchange``: every explainer with each registration method, or each estimator of uncertainty, in turn."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Annotated, Any

import numpy as np

from gpca.alignment.features import estimate_normals
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.attribution.predictions import prediction_frame
from gpca.classifier.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.errors import InputError
from gpca.explainers.interface import ExplainerEntry, answer_of
from gpca.explainers.registry import Embed, described_for, explainer_entry, make_rivals
from gpca.io.csv_file import write_csv
from gpca.io.files import SPLITS
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, ragged
from gpca.pairs.judge import Judges
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.rigid import scale_translation, transform
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds, Count, Distinct, fields_of, read_settings
from gpca.steps.registration_trials import outcomes_by
from gpca.uncertainty.designs import ADDITIVE_KNOBS, RegisteredRow
from gpca.uncertainty.estimators import interface
from gpca.uncertainty.estimators.analytic import sample
from gpca.uncertainty.estimators.registry import make_estimator
from gpca.uncertainty.interventions import UNTOUCHED, KnobbedSource, Knobs
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import divergence

BALANCED = {"multipleOf": 3}  # over the concepts
METHOD, ESTIMATOR = "method", "estimator"  # the two exchanges
LABELS = ("exchanged", "learnt_from", "asked_of", "explainer")  # columns before those of a prediction file
FAILURE = "failure"  # the column behind them: why the method failed, or the estimator
TOO_FEW = "too few training registrations have an estimate"
DESIGN = "additive"  # the design whose conditions are estimated
MOVED: interface.Moved = "observed"  # onto the model, as the paper's protocol has it
OBSERVED = (UNTOUCHED,)  # the condition of explainers that read the observed pair alone


@dataclass(frozen=True)
class ExchangeSettings:
    """The methods and estimators, and the numbers of registrations of each source and seed, at most."""

    seeds: Count = 3
    methods: Distinct[str] = ("point_to_point", "point_to_plane")  # for training and for test registrations in turn
    train: Annotated[int, Bounds(minimum=9, **BALANCED)] = 120  # by each of them
    test: Annotated[int, Bounds(minimum=3, **BALANCED)] = 60
    points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 512  # of source and of target
    estimators: Distinct[str] = ("monte_carlo",)
    estimated_train: Annotated[int, Bounds(minimum=9, **BALANCED)] = 24  # and as many from which estimators learn
    estimated_test: Annotated[int, Bounds(minimum=3, **BALANCED)] = 9  # that are explained by their uncertainty


def run(job: Job) -> None:
    from gpca.encoders.training import embedding_by, load_model

    settings = read_settings(ExchangeSettings, job.section("exchange"))
    encoder = EncoderSettings(**job.section("encoder"))
    methods, estimators = job.by_name("methods", settings.methods), job.by_name("estimators", settings.estimators)
    uncertainty = UncertaintySettings(**fields_of(job.section("uncertainty"), UncertaintySettings))
    objects = ObjectClouds.load(job.objects, job.source)
    for seed, registrations_path, weights, out in job.per_seed("registrations", "encoders", "out"):
        rivals = make_rivals(job.section("explainers"), job.source, seed)
        with record_provenance([out], [job.objects, registrations_path, weights], job.settings, seed=seed):
            embedded = embedding_by(load_model(weights, encoder, axes=(job.source, seed)), seed, encoder)
            exchange = Exchange(job.source, seed, settings, methods, estimators, uncertainty, rivals, embedded)
            judges = Judges(objects, f"objects of {job.source}")
            write_csv(out, exchange.run(Registrations.load(registrations_path, (job.source, seed)), judges))


def require_exchangeable(name: str) -> None:
    """Raise an InputError if the explainer reads another design than ``additive``, or more than its observed pair."""
    entry = explainer_entry(name)
    if entry.design not in (None, DESIGN) and not entry.observed_only:
        fault = f"reads design '{entry.design}', which estimators do not provide"
        raise InputError(f"explainer '{name}'", fault, f"choose one that reads '{DESIGN}'")


@dataclass(frozen=True)
class Exchange:
    """The methods and estimators that are exchanged for the explainers of one source and seed."""

    source: str
    seed: int
    settings: ExchangeSettings
    methods: Mapping[str, Mapping]  # name -> settings, as of the estimators
    estimators: Mapping[str, Mapping]
    uncertainty: UncertaintySettings
    rivals: Mapping[str, ExplainerEntry]  # those that read an uncertainty get each estimator's, others each method's
    embed: Embed

    def run(self, registrations: Registrations, judges: Judges) -> Frame:
        """Return predictions after `LABELS`, which name what registered or estimated training and test pairs."""
        import pandas as pd

        by_estimator = {name: rival for name, rival in self.rivals.items() if rival.reads.startswith("uncertainty/")}
        by_method = {name: rival for name, rival in self.rivals.items() if name not in by_estimator}
        frames = list(self._by_methods(registrations, by_method)) if by_method else []
        if by_estimator:
            frames += self._by_estimators(registrations, by_estimator, judges)
        return pd.concat(frames, ignore_index=True)

    def _by_methods(self, registrations: Registrations, rivals: Mapping[str, ExplainerEntry]) -> Iterator[Frame]:
        splits = {"train": self.settings.train, "test": self.settings.test}
        rows = np.concatenate([first(registrations, *split) for split in splits.items()])
        axes = self.source, self.seed, self.settings.points
        registered = {}
        for name, (anew, failure_S) in registered_by(registrations.subset(rows), self.methods, *axes).items():
            h_S_d, logits_S_C = self.embed(anew, self.source)
            seen = replace(anew, attached={"embedding": h_S_d, "head_logits": logits_S_C})
            registered[name] = described_for(rivals, seen), failure_S
        for learnt_from, (train, _) in registered.items():
            for explainer_name, rival in rivals.items():
                explainer = rival.made()
                explainer.fit(train.subset(train.rows("train")))
                for asked_of, (tested, failure_S) in registered.items():
                    test = tested.subset(tested.rows("test"))
                    labels = dict(zip(LABELS, (METHOD, learnt_from, asked_of, explainer_name), strict=True))
                    frame = prediction_frame(test, answer_of(explainer, test.without_labels()), **labels)
                    yield frame.assign(**{FAILURE: failure_S[tested.rows("test")]})

    def _by_estimators(
        self, registrations: Registrations, rivals: Mapping[str, ExplainerEntry], judges: Judges
    ) -> Iterator[Frame]:
        train_rows = first(registrations, "train", 2 * self.settings.estimated_train)
        half = len(train_rows) // 2 // len(CONCEPTS) * len(CONCEPTS)  # threes of one object stay together
        test_rows = first(registrations, "test", self.settings.estimated_test)
        described = described_for(rivals, registrations.subset(np.concatenate([train_rows[:half], test_rows])))
        rows = {split: described.rows(split) for split in SPLITS}
        axes = self.source, self.seed, self.uncertainty
        examples = KnobbedRegistrar(registrations, *axes).examples(train_rows[half:], judges)
        estimators = {name: make_estimator(name, entry, examples) for name, entry in self.estimators.items()}
        registrar = KnobbedRegistrar(described.without_labels(), *axes)
        learned = rows["train"] if any(rival.observed_only for rival in rivals.values()) else np.arange(0)
        estimates_of_train = registrar.estimates(learned, estimators, OBSERVED)
        estimates_of_test = registrar.estimates(rows["test"], estimators)
        train, test = (described.subset(each) for each in rows.values())
        for estimator in estimators:
            train_estimates, test_estimates = estimates_of_train[estimator], estimates_of_test[estimator]
            for name, rival in rivals.items():
                floor, conditions = self.uncertainty.floor, len(OBSERVED if rival.observed_only else ADDITIVE_KNOBS)
                explainer, failure_S = rival.made(), test_estimates.failures(conditions)
                if rival.observed_only:
                    usable = np.flatnonzero(train_estimates.failures(len(OBSERVED)) == "")
                    if set(train.concept[usable]) < set(CONCEPTS):
                        failure_S = np.where(failure_S == "", TOO_FEW, failure_S)
                    else:
                        explainer.fit(train_estimates.attach_to(train, usable, len(OBSERVED), floor))
                # Abstained where there is no estimate.
                scores_S_C, abstained_S = np.zeros((len(test), len(CONCEPTS))), np.ones(len(test), bool)
                estimated = np.flatnonzero(failure_S == "")
                if len(estimated):
                    asked = test_estimates.attach_to(test.without_labels(), estimated, conditions, floor)
                    answer = answer_of(explainer, asked)
                    scores_S_C[estimated], abstained_S[estimated] = answer.scores_N_C, answer.abstained_N
                attribution = Attribution.of_scores(CONCEPTS, scores_S_C, abstained_N=abstained_S)
                labels = dict(zip(LABELS, (ESTIMATOR, estimator, estimator, name), strict=True))
                yield prediction_frame(test, attribution, **labels).assign(**{FAILURE: failure_S})


def first(registrations: Registrations, split: str, samples: int) -> np.ndarray:
    """Rows of a split's first samples: threes of one object, which alternate between the objects."""
    return np.flatnonzero((registrations.split == split) & (registrations.sample < samples))


def registered_by(
    registrations: Registrations, methods: Mapping[str, Mapping], source: str, seed: int, points: int
) -> dict[str, tuple[Registrations, np.ndarray]]:
    """Return the registrations by each method, and why each failed (S,), empty if it did not."""
    targets = [registrations.target(row) for row in range(len(registrations))]
    by_method = {}
    for name, outcomes_S in outcomes_by(methods, registrations, source, seed, points).items():
        poses = [outcome.T_target_source for outcome in outcomes_S]
        clouds = [transform(T, registrations.source(row)).astype(np.float32) for row, T in enumerate(poses)]
        moved: dict[str, Any] = ragged(clouds, targets)
        scaled = [scale_translation(*each) for each in zip(poses, registrations.diameter_m, strict=True)]
        anew = replace(
            registrations,
            **moved,
            T_target_source_icp=np.array(scaled),
            fitness=np.array([outcome.fitness for outcome in outcomes_S]),
            inlier_rmse=np.array([outcome.inlier_rmse for outcome in outcomes_S]),
            attached={},
        )
        by_method[name] = anew, np.array([outcome.failure for outcome in outcomes_S])
    return by_method


@dataclass(frozen=True)
class Estimates:
    """One estimator's covariances of S registrations under K conditions."""

    covariance: np.ndarray  # (S, K, 6, 6), radians and diameters; NaN where there is none
    failure: np.ndarray  # (S, K) why there is none

    def failures(self, conditions: int) -> np.ndarray:
        """Return why one of the first `conditions` has no estimate (S,), empty where all have one."""
        return np.array([next(filter(None, row), "") for row in self.failure[:, :conditions]])

    def attach_to(self, registrations: Registrations, rows: np.ndarray, conditions: int, floor: float) -> Registrations:
        """Return rows of the S registrations with the outcomes of a design attached for explainers, at no cost."""
        covariance = self.covariance[rows, :conditions]
        outcomes = {"covariance": covariance, "uncertainty": divergence(covariance[:, :1], covariance, floor)}
        outcomes |= dict.fromkeys(("icp_calls", "seconds", "icp_seconds"), np.zeros(covariance.shape[:2]))
        subset = registrations.subset(rows)
        return replace(subset, attached={**subset.attached, **outcomes})


class KnobbedRegistrar:
    """Registers the rows of a source and seed by point-to-point ICP, under any setting of the knobs."""

    def __init__(self, registrations: Registrations, source: str, seed: int, settings: UncertaintySettings) -> None:
        self._registrations, self._axes, self._settings = registrations, (source, seed, "uncertainty"), settings
        self._register = make_method(interface.POINT_TO_POINT)

    def under(self, row: int, settings_of_knobs: Sequence[Knobs]) -> Iterator[interface.RegisteredPair]:
        """Yield the registration of a row under each setting."""
        registrations, settings = self._registrations, self._settings
        axes = (*self._axes, registrations.split[row], registrations.sample[row])
        random = generator(*axes, "clouds")
        points, target, T_init, _ = RegisteredRow(registrations, row).observed(settings.icp_points, random)
        source = KnobbedSource(points, random)
        normals = estimate_normals(target)
        for knobs in settings_of_knobs:
            pair = Pair(source.at(knobs), target, T_init, None, normals, seed_of(*axes, "estimates"))
            outcome = self._register(pair)
            deviation_6 = knobs.spread * settings.deviation_6()
            described = cache(lambda pair=pair, outcome=outcome: interface.describe(pair, outcome, MOVED))
            yield interface.RegisteredPair(pair, outcome, interface.POINT_TO_POINT, deviation_6, described)

    def examples(self, rows: np.ndarray, judges: Judges) -> list[interface.Example]:
        """Return rows as estimators learn from them."""
        examples = []
        for row in rows:
            [registered] = self.under(row, OBSERVED)
            T_true = self._registrations.T_target_source("true", row)
            starts, judge = self._settings.starts, judges.of(self._registrations, row)
            draw = partial(sample, registered, starts, *self._axes, "examples")
            examples.append(interface.example(registered, T_true, judge, MOVED, draw, starts))
        return examples

    def estimates(
        self,
        rows: np.ndarray,
        estimators: Mapping[str, Callable[[interface.RegisteredPair], interface.CovarianceEstimate]],
        settings_of_knobs: Sequence[Knobs] = ADDITIVE_KNOBS,
    ) -> dict[str, Estimates]:
        """Return the covariances of the rows under each setting, by estimator."""
        shape = len(rows), len(settings_of_knobs)
        estimates = {
            name: Estimates(np.full((*shape, 6, 6), np.nan), np.full(shape, "", object)) for name in estimators
        }
        for s, row in enumerate(progress(rows, f"estimates of {self._axes[0]}, seed {self._axes[1]}")):
            for k, registered in enumerate(self.under(row, settings_of_knobs)):
                for name, estimate in estimators.items():
                    answer = estimate(registered)
                    if answer.covariance_6_6 is None:
                        estimates[name].failure[s, k] = answer.failure
                    else:
                        estimates[name].covariance[s, k] = answer.covariance_6_6
        return estimates
