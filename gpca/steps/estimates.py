"""Step ``estimate``: every estimator says how uncertain test registrations of the causes are, held against references.

References are what further registrations of the same situation find, where the method begins at other initial poses
(``starts``), surfaces are sampled again with other noise and outliers (``data``), or both (``all``).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import islice
from time import perf_counter

import numpy as np

from gpca.alignment.batched_icp import BatchedICP, BatchedPlaneICP, register_each
from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import ITERATIONS, REACH, Pair
from gpca.alignment.methods.registry import make_method
from gpca.causes.candidate import Candidate, drawn_again
from gpca.causes.dataset import Causes
from gpca.causes.descriptors import observed_pair
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.judge import Judges
from gpca.pairs.perturbation import within_half_space
from gpca.process.progress import progress
from gpca.rigid import exp, inverse, point_jacobians, transform
from gpca.seeds import generator, seed_of
from gpca.steps.registration_trials import timed
from gpca.uncertainty import estimates
from gpca.uncertainty.estimates import KINDS, EstimatorPairSettings, Kind
from gpca.uncertainty.estimators import interface
from gpca.uncertainty.estimators.analytic import sample
from gpca.uncertainty.estimators.registry import estimator_entry, make_estimator
from gpca.uncertainty.settings import start_deviation
from gpca.uncertainty.spread import divergence

MOVED: interface.Moved = "model"  # onto the observed cloud, as the causes' track has it
LEVEL = 0.95  # of the region whose coverage is counted
Clouds = Iterator[tuple[np.ndarray, np.ndarray]]  # (N, 3) of sources and (P, 3) of targets
SETTINGS = ICPSettings("point_to_point", REACH, ITERATIONS)  # to points and to planes
AT_ONCE = 50  # point-to-plane runs that go one step at a time together


@dataclass(frozen=True)
class Redraws:
    """Draws the clouds of a candidate again, with the same causes, severities and numbers of points."""

    candidate: Candidate
    surface: np.ndarray  # (N, 3) points of its object, of which model and observation take different ones
    T_target_observed: np.ndarray  # 4×4, from the candidate's frame
    points: int  # of source and of target, at most

    def clouds(self, *axes: object) -> Clouds:
        """Yield the model as the source and what is observed as the target, without end, drawn by the axes."""
        sampling, noise, outliers = (generator(*axes, name) for name in ("sampling", "noise", "outliers"))
        severity, n_model = self.candidate.severity, len(self.candidate.model)
        n_drawn = n_model + len(self.candidate.clean)
        while True:
            drawn = self.surface[sampling.choice(len(self.surface), n_drawn, replace=False)]
            model, clean = drawn[:n_model], drawn[n_model:]
            observed = clean + severity["noise"] * noise.normal(size=clean.shape)
            astray = outliers.random(len(clean)) < severity["outliers"]
            observed = np.where(astray[:, None], outliers.uniform(-0.5, 0.5, size=clean.shape), observed)
            if self.candidate.toward_hidden is not None:
                along = (clean * self.candidate.toward_hidden).sum(axis=1)
                observed = observed[within_half_space(along, severity["crop"], FEWEST_POINTS)]
            observed = observed[sampling.permutation(len(observed))[: self.points]]
            yield model[: self.points], transform(self.T_target_observed, observed)


def draw_twists(
    kind: Kind, registered: interface.RegisteredPair, redraws: Redraws, repeats: int, *axes: object
) -> np.ndarray:
    """Return the results of so many registrations as twists (n, 6) about the pose; FailedEstimate for too few."""
    if kind == "starts":
        return sample(registered, repeats, *axes)
    axes = (*axes, kind, registered.pair.seed)
    deviation_6 = registered.deviation_6 if kind == "all" else np.zeros(6)
    xi_n_6 = generator(*axes, "starts").normal(size=(repeats, 6)) * deviation_6
    starts_n = exp(xi_n_6) @ registered.pair.T_target_source_init
    return registered.twists_of(*_register_each(registered.method, redraws.clouds(*axes), starts_n))


def _register_each(method: str, clouds: Clouds, starts_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses of other clouds registered from each start (n, 4, 4), and which found a correspondence (n,)."""
    parts = []
    if method == interface.POINT_TO_PLANE:
        for at in range(0, len(starts_n), AT_ONCE):
            starts_k = starts_n[at : at + AT_ONCE]
            pairs = list(islice(clouds, len(starts_k)))
            icps = [BatchedPlaneICP(target, estimate_normals(target), SETTINGS) for _, target in pairs]
            parts.append(register_each(icps, [source for source, _ in pairs], starts_k)[:2])
    elif method == interface.POINT_TO_POINT:
        for start, (source, target) in zip(starts_n, clouds, strict=False):  # the clouds are without end
            parts.append(BatchedICP(target, SETTINGS).register(source, start[None])[:2])
    else:
        register = make_method(method)
        for start, (source, target) in zip(starts_n, clouds, strict=False):
            outcome = register(Pair(source, target, start).with_normals())
            parts.append((outcome.T_target_source[None], np.array([outcome.fitness])))
    poses, fitness = zip(*parts, strict=True)
    return np.concatenate(poses), np.concatenate(fitness) > 0


@dataclass(frozen=True)
class EstimatedRow:
    """A test registration by one method."""

    columns: dict[str, object]  # of every row about it: sample, object, method, errors
    registered: interface.RegisteredPair
    true_twist: np.ndarray  # (6,) of the true pose about that of the registration, the nearest of symmetric ones
    # By kind: twists (n, 6) of the results about the pose, none where too few runs found any correspondence; seconds
    references: Mapping[Kind, tuple[np.ndarray, float]]


@dataclass(frozen=True, eq=False)
class DrawnCauses:
    """Registrations of one source and seed with measured causes, and what it takes to draw them again."""

    source: str
    seed: int
    causes: Causes
    drawn_by: CauseSettings  # settings that the causes were drawn with
    objects: ObjectClouds
    judges: Judges

    def case(self, row: int, method: str, settings: EstimatorPairSettings) -> EstimatedRow:
        """A test registration by a method with the references."""
        registrations = self.causes.registrations
        judge = self.judges.of(registrations, row)
        registered, T_true, redraws = self._registered(row, method, settings)
        # ADD moves the object, which is the source here: errors are those of the inverse pose.
        error = judge(inverse(registered.T_target_source), inverse(T_true))["add_relative"]
        columns = {
            "sample": registrations.sample[row],
            "object": registrations.object_name[row],
            "cluster": registrations.cluster[row],
            "method": method,
            "add_relative": error,
            "failed": bool(error >= settings.failed or not registered.outcome.fitness),
            "inlier_rmse": registered.outcome.inlier_rmse,
            "fitness": registered.outcome.fitness,
        }
        references: dict[Kind, tuple[np.ndarray, float]] = {}
        for kind in KINDS:
            started = perf_counter()
            try:
                twists_n_6 = draw_twists(kind, registered, redraws, settings.repeats, *self._axes(method), "reference")
            except interface.FailedEstimate:
                twists_n_6 = np.empty((0, 6))
            references[kind] = twists_n_6, perf_counter() - started
        return EstimatedRow(columns, registered, interface.true_twist(registered, T_true, judge, MOVED), references)

    def example(self, row: int, method: str, settings: EstimatorPairSettings) -> interface.Example:
        """Return a training registration with results of a few registrations of other data from other starts."""
        registered, T_true, redraws = self._registered(row, method, settings)
        judge, runs = self.judges.of(self.causes.registrations, row), settings.train_starts
        draw = partial(draw_twists, "all", registered, redraws, runs, *self._axes(method), "examples")
        return interface.example(registered, T_true, judge, MOVED, draw, runs)

    def _axes(self, method: str) -> tuple:
        return self.source, self.seed, "estimators", method

    def _registered(
        self, row: int, method: str, settings: EstimatorPairSettings
    ) -> tuple[interface.RegisteredPair, np.ndarray, Redraws]:
        """Register the model, the source, to the observed cloud, in the frame where the causes have put that.

        Return also the true pose, which takes what was observed there, and what draws the clouds again; InputError
        where the row was drawn with other settings or objects.
        """
        registrations = self.causes.registrations
        observed = observed_pair(self.causes, row, *self._axes(method))
        random = generator(*observed.axes, "clouds")
        clouds = (observed.model, observed.observed)
        source, target = (cloud[random.permutation(len(cloud))[: settings.points]] for cloud in clouds)
        pair = Pair(source, target, inverse(observed.T_init), seed=seed_of(*observed.axes, "draws")).with_normals()
        outcome = make_method(method)(pair)
        deviation_6 = start_deviation(settings.start_rotation_deg, settings.start_translation)
        registered = interface.RegisteredPair(
            pair, outcome, method, deviation_6, lambda: interface.describe(pair, outcome, MOVED)
        )
        T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
        T_true = T_icp @ inverse(T_true)
        candidate, surface = drawn_again(self.objects, self.causes, row, self.source, self.seed, self.drawn_by)
        return registered, T_true, Redraws(candidate, surface, T_true, settings.points)


def run(job: Job) -> None:
    settings = EstimatorPairSettings(**job.section("estimator_pairs"), failed=job.section("success")["error"])
    drawn_by = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    estimators = job.by_name("estimators", job.estimators)
    objects = ObjectClouds.load(job.objects, job.source)
    judges = Judges(objects, f"objects of {job.source}")
    for i, (seed, path) in enumerate(job.per_seed("causes")):
        of_seed = slice(i, None, len(job.seeds))
        out, timings = job.rows[of_seed], job.timings[of_seed]
        with record_provenance([*out, *timings], [job.objects, path], job.settings, seed=seed):
            causes = Causes.load(path, (job.source, seed))
            situations = DrawnCauses(job.source, seed, causes, drawn_by, objects, judges)
            rows, _ = try_estimators(situations, estimators, settings)
            for name, own_out, own_timings in zip(job.estimates, out, timings, strict=True):
                write_csv(own_out, rows[name].drop(columns="seconds"))
                write_csv(own_timings, rows[name][["sample", "method", "seconds"]])


def try_estimators(
    situations: DrawnCauses, estimators: Mapping[str, Mapping], settings: EstimatorPairSettings
) -> tuple[dict[str, Frame], list[EstimatedRow]]:
    """Return the rows of each reference and estimator, one per registration, with seconds; and the registrations."""
    import pandas as pd

    records: dict[str, list[dict]] = {}
    cases = []
    learns = any(estimator_entry(name).learn for name in estimators)
    tested = situations.causes.rows("test")
    for method, wanted in settings.methods.items():
        train = spaced(situations.causes.rows("train"), settings.train if learns else 0)
        examples = [situations.example(row, method, settings) for row in train]
        trained = {name: make_estimator(name, entry, examples) for name, entry in estimators.items()}
        title = f"estimators on {situations.source}, seed {situations.seed}, {method}"
        for row in progress(spaced(tested, wanted), title):
            case = situations.case(row, method, settings)
            cases.append(case)
            answers = {}
            for kind, (twists_n_6, seconds) in case.references.items():
                answer = interface.CovarianceEstimate(None, "too few of the reference's runs found a correspondence")
                if len(twists_n_6):
                    answer = interface.CovarianceEstimate(np.cov(twists_n_6, rowvar=False), "")
                answers[f"reference_{kind}"] = answer, seconds
            answers |= {name: timed(estimate, case.registered) for name, estimate in trained.items()}
            for name, (answer, seconds) in answers.items():
                records.setdefault(name, []).append(judged(case, answer, settings.floor) | {"seconds": seconds})
    return {name: pd.DataFrame(of_estimator) for name, of_estimator in records.items()}, cases


def spaced(rows: np.ndarray, wanted: int) -> np.ndarray:
    """So many of the rows, evenly spaced: states that are rare come last."""
    return rows[np.unique(np.linspace(0, len(rows) - 1, min(wanted, len(rows))).round().astype(int))]


def judged(case: EstimatedRow, answer: interface.CovarianceEstimate, floor: float) -> dict[str, object]:
    """Row of an estimate; numbers that it lacks are NaN."""
    numbers = dict.fromkeys(estimates.JUDGED, np.nan)
    if (sigma_6_6 := answer.covariance_6_6) is not None:
        e_6, floored_6_6 = case.true_twist, sigma_6_6 + floor * np.eye(6)
        numbers["error_ratio"] = float(e_6 @ e_6 / np.trace(floored_6_6))
        numbers["mahalanobis"] = float(e_6 @ np.linalg.solve(floored_6_6, e_6))  # χ² with six degrees where it is right
        # Root mean square distance by which points would move: √ mean tr(J Σ Jᵀ).
        jacobians_N_3_6 = point_jacobians(transform(case.registered.T_target_source, case.registered.pair.source))
        squares_N = np.einsum("nij,jk,nik->n", jacobians_N_3_6, sigma_6_6, jacobians_N_3_6)
        numbers["spread"] = float(np.sqrt(max(squares_N.mean(), 0.0)))
        for kind, (twists_n_6, _) in case.references.items():
            numbers |= {f"{name}_{kind}": value for name, value in compared(sigma_6_6, twists_n_6, floor).items()}
    return {**case.columns, "failure": answer.failure} | numbers | estimates.covariance_columns(sigma_6_6)


def compared(sigma_6_6: np.ndarray, twists_n_6: np.ndarray, floor: float) -> dict[str, float]:
    """Return how a covariance Σ fits the results of a reference about their mean, which have the covariance S.

    KL divergences of the 3×3 blocks (nats), tr S / tr Σ, tr Σ⁻¹S, and the share of the results within the 95 % region
    of Σ; the floor is added to both, so that a spread below it counts as none. Nothing where the reference has none.
    """
    from scipy.stats import chi2

    if not len(twists_n_6):
        return {}
    S_6_6 = np.cov(twists_n_6, rowvar=False)
    floored_6_6, expected_6_6 = (matrix + floor * np.eye(6) for matrix in (sigma_6_6, S_6_6))
    away_n_6 = twists_n_6 - twists_n_6.mean(axis=0)
    squares_n = np.einsum("ni,in->n", away_n_6, np.linalg.solve(floored_6_6, away_n_6.T))
    return {
        "kl_rotation": float(divergence(S_6_6[:3, :3], sigma_6_6[:3, :3], floor)),
        "kl_translation": float(divergence(S_6_6[3:, 3:], sigma_6_6[3:, 3:], floor)),
        "error_ratio": float(np.trace(expected_6_6) / np.trace(floored_6_6)),
        "mahalanobis": float(np.trace(np.linalg.solve(floored_6_6, expected_6_6))),
        "covered": float((squares_n <= chi2.ppf(LEVEL, 6)).mean()),
    }
