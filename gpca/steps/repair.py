"""Step ``repair_attempts``: poses for registrations, which :mod:`gpca.steps.repair_verdicts` accepts or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from time import perf_counter
from typing import Annotated, Any

import numpy as np

from gpca.alignment.batched_icp import AnyICP, icp_to
from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.pose_error import displacements
from gpca.causes.dataset import Causes, labels_of
from gpca.causes.descriptors import observed_pair
from gpca.causes.scans import OverlapErrors
from gpca.causes.settings import OBSERVED, CauseSettings, Moved
from gpca.causes.truth import capped
from gpca.errors import InputError
from gpca.io.arrays import TEXT, WHOLE, require_numbers
from gpca.io.container import Container, array
from gpca.io.csv_file import ANY, finite_number, numbers, read_csv, write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.model.proposed import Errors, Proposed, joined, pose_errors, propose_for
from gpca.model.repair import Proposals, measured, search
from gpca.objects.canonical import BY_ICP, ObjectClouds
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.reenactment.dataset import Reenactments
from gpca.reenactment.hypotheses import search_starts
from gpca.reenactment.scans import REACH
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import exp, inverse, require_rigid, transform
from gpca.scans.pair import near
from gpca.seeds import generator, seed_of
from gpca.settings import Bounds, Count, read_settings

REPAIR, LIKELIEST, STARTS, MANY_STARTS = "repair", "likeliest", "starts", "many_starts"
DIGITS = 12  # of what rivals find
TESTS = ("fitness", "inlier_rmse", "trimmed_cost", "spread", "weight")  # of a pose; the smaller, the surer
NEVER = 1e6  # score of a pose that is not accepted
TRIMMED = 0.8  # share of the distances that a trimmed cost counts, the smallest
RUNS = 13  # of ICP around a pose, for its spread,
RUN_ROTATION_DEG, RUN_TRANSLATION = 10.0, 0.05  # root mean square offsets of their starts


Own = Callable[[np.ndarray, np.ndarray, np.ndarray], Any]  # observed, model, initial pose -> pose, with confidence


@dataclass(frozen=True, kw_only=True)
class Asked:
    """How many registrations are asked about, and by how many points."""

    samples: Count = 1000  # test registrations of each file, at most
    points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 2048  # of each cloud that the rivals register, at most


@dataclass(frozen=True, kw_only=True)
class RepairSettings(Asked):
    """The same, and registration methods beside those built in -> their settings."""

    methods: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Attempts(Container):
    """What was proposed for N registrations (P columns, as in `Proposed`), and made of them by M rivals: C = P + M."""

    sample_N: np.ndarray = array("N", WHOLE)
    group_N: np.ndarray = array("N", TEXT)  # kind of start on frames; else the same for all
    cluster_N: np.ndarray = array("N", TEXT)  # that the bootstrap draws
    label_N: np.ndarray = array("N", TEXT)  # dominant cause of a failure by its mean error; ``none`` of any other
    points_N: np.ndarray = array("N", WHOLE)  # of the smaller cloud
    start_error_N: np.ndarray = array("N", least=0)  # of the initial pose, as errors of poses are
    error_N_C: np.ndarray = array("N C", least=0)
    weight_N_C: np.ndarray = array("N C", least=0, most=1)
    distance_N_C_K: np.ndarray = array("N C K", least=0)
    hypothesis_N_C_K: np.ndarray = array("N C K", least=0, most=1)
    inlier_rmse_N_C: np.ndarray = array("N C", least=0)
    fitness_N_C: np.ndarray = array("N C", least=0, most=1)
    family_N: np.ndarray = array("N", TEXT)
    score_N_M_Q: np.ndarray = array(f"N M {len(TESTS)}")
    method_M: np.ndarray = array("M", TEXT)

    def columns(self, chosen: slice) -> Proposed:
        """Return some columns as if they were proposals."""
        names = [name for name in self.array_fields() if "_N_C" in name]
        arrays: dict[str, Any] = {name.replace("_C", "_P"): getattr(self, name)[:, chosen] for name in names}
        return Proposed(**arrays, family_N=self.family_N)

    @property
    def proposed(self) -> Proposed:
        return self.columns(slice(-len(self.method_M)))

    @property
    def rivals(self) -> Proposed:
        return self.columns(slice(-len(self.method_M), None))


def attempt(job: Job) -> None:
    """Ask about the test registrations of a file of causes; scans and frames bring samples and re-enactments."""
    import pandas as pd

    settings = read_settings(RepairSettings, job.section("repair"))
    truth = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    reenactment = read_settings(ReenactmentSettings, job.section("reenactment"))
    objects, samples, enacted = (job.get(name) for name in ("objects", "samples", "reenactments"))
    inputs = [job.causes, *filter(None, (objects, samples, enacted))]
    with record_provenance([job.attempts, job.timings], inputs, job.settings, seed=job.seed):
        causes = Causes.load(job.causes, job.axes)
        numbered = pd.DataFrame({"sample": causes.registrations.sample})
        about = read_csv(samples, ("sample",), others=ANY) if samples else numbered
        rows = causes.rows("test")
        if "times" in about:  # scans with added noise are left out
            rows = rows[(numbers(samples, about, "times") == 0).to_numpy()[rows]]
        if "truth" in about:
            rows = rows[(about["truth"] != BY_ICP).to_numpy()[rows]]
        rows = np.sort(generator(*job.axes, "repair", "samples").permutation(rows)[: settings.samples])
        if not len(rows):
            raise InputError(job.causes, "has no registration to repair", "raise its number of test samples")
        about = about.iloc[rows].reset_index(drop=True)
        read = Reenactments.load(enacted, causes.registrations).subset(rows) if enacted else None
        moved = OBSERVED if "error_factor" in about else truth.moved
        world = World(causes.subset(rows), about, objects and ObjectClouds.load(objects, job.source))

        def hypotheses(pair: ObservedPair, row: int) -> tuple[np.ndarray, np.ndarray]:
            return (read.T_model_observed[row], read.weight[row]) if read is not None else searched(pair, reenactment)

        attempts, seconds = try_all(world, settings, truth.icp, moved, hypotheses, job.axes)
        attempts.save(job.attempts, job.axes)
        write_csv(job.timings, seconds)


class World:
    """What is known of registrations for judging poses of them: columns of their samples; scans have no object."""

    def __init__(self, causes: Causes, about: Any, objects: ObjectClouds | None) -> None:
        self.causes, self.about = causes, about
        self.errors: Errors = pose_errors(causes, objects) if objects else self._overlap_errors

    def _overlap_errors(self, row: int, T_n: np.ndarray) -> np.ndarray:
        registrations = self.causes.registrations
        T_true = registrations.T_target_source("true", row)
        points, target = transform(T_true, registrations.source(row)), registrations.target(row).astype(np.float64)
        common_N = near(points, target, REACH * ModelSurface(target).spacing)
        judged = OverlapErrors(points[common_N] if common_N.any() else points, float(self.about["error_factor"][row]))
        return capped(judged(np.array([T_true @ inverse(T) for T in T_n])))

    @cached_property
    def columns(self) -> dict[str, Any]:
        """The columns of :class:`Attempts` that say what the registrations are."""
        causes, registrations = self.causes, self.causes.registrations
        count, cluster_N, group_N = len(causes), registrations.cluster, np.full(len(causes), "all")
        if "dataset" in self.about:
            cluster_N = (self.about["dataset"] + " " + self.about["scene"].astype(str)).to_numpy(str)
            group_N = self.about["start"].to_numpy(str)
        named_N = labels_of(causes.truth)
        sizes = [min(len(registrations.source(row)), len(registrations.target(row))) for row in range(count)]
        return {
            "sample_N": registrations.sample,
            "group_N": group_N,
            "cluster_N": cluster_N,
            "label_N": np.where(np.isin(named_N, CONCEPTS), named_N, "none"),
            "points_N": np.array(sizes),
            "start_error_N": np.array([self.errors(row, np.eye(4)[None])[0] for row in range(count)]),
            "family_N": registrations.cluster,
        }


def searched(pair: ObservedPair, settings: ReenactmentSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return hypotheses (K, 4, 4) of a pair's true pose and probabilities (K,): 0 where the first fills up."""
    T_k, weight_k = search(pair, settings, ModelSurface(pair.model))
    missing = settings.hypotheses - len(T_k)
    return np.concatenate([T_k, *[T_k[:1]] * missing]), np.pad(weight_k, (0, missing))


def try_all(
    world: World,
    settings: RepairSettings,
    icp: ICPSettings,
    moved: Moved,
    hypotheses: Callable[[ObservedPair, int], tuple[np.ndarray, np.ndarray]],
    axes: tuple,
    functions: Mapping[str, Own] | None = None,
) -> tuple[Attempts, Any]:
    """Return the attempts at every registration, and a frame of the seconds of each method; see :class:`Rivals`."""
    import pandas as pd

    methods, functions = {name: make_method(name, entry) for name, entry in settings.methods.items()}, functions or {}
    proposals, errors, columns, seconds = [], [], [], []
    registrations = world.causes.registrations
    for row in progress(range(len(registrations)), f"repairs of {axes[0]}, seed {axes[1]}"):
        pair = observed_pair(world.causes, row, *axes, "reenactment")
        started = perf_counter()
        T_K, weight_K = hypotheses(pair, row)
        surface = ModelSurface(pair.model)
        proposals.append(propose_for(pair, T_K, weight_K, icp, moved, surface))
        errors.append(world.errors(row, proposals[-1].T_n))
        rival = Rivals(pair, surface, icp, settings.points, proposals[-1], perf_counter() - started)
        tried = rival.built_in()
        tried |= {name: rival.by(name, method, warm=row == 0) for name, method in methods.items()}
        tried |= {name: rival.by_function(name, function) for name, function in functions.items()}
        poses, scores, spent = zip(*tried.values(), strict=True)
        T_M = np.array(poses)
        fitness_M, rmse_M = measured(rival.before, pair.model, icp, moved)(T_M)
        assert proposals[-1].true_poses is not None
        judged_M = proposals[-1].true_poses.errors(T_M)
        columns.append((world.errors(row, T_M), np.zeros(len(T_M)), *judged_M, rmse_M, fitness_M, np.array(scores)))
        names_and_seconds = zip((REPAIR, *tried), (rival.repair_seconds, *spent), strict=True)
        seconds += [(int(registrations.sample[row]), *each) for each in names_and_seconds]
    *of_rivals, score_N_M_Q = map(np.array, zip(*columns, strict=True))
    of_proposals = joined(proposals, errors, registrations.cluster).arrays.values()  # the last is no column's
    names = [name for name in Attempts.array_fields() if "_N_C" in name]
    pairs = zip(names, of_proposals, of_rivals, strict=False)
    columns_N_C: dict[str, Any] = {name: np.hstack(both) for name, *both in pairs}
    attempts = Attempts(**world.columns, **columns_N_C, score_N_M_Q=score_N_M_Q, method_M=np.array([*tried]))
    return attempts, pd.DataFrame(seconds, columns=["sample", "method", "seconds"])


# What a rival found: a pose (4×4) that takes what was observed, before the registration, to the model; scores (Q,) of
# `TESTS`; the seconds that it took.
Tried = tuple[np.ndarray, np.ndarray, float]


@dataclass(frozen=True)
class Rivals:
    """The rivals of a repair, on one pair."""

    pair: ObservedPair
    surface: ModelSurface
    icp: ICPSettings
    points: int
    proposals: Proposals
    repair_seconds: float

    @cached_property
    def before(self) -> np.ndarray:
        """(N, 3) what was observed, before the registration, in the model's frame."""
        return transform(self.pair.T_init, self.pair.observed)

    @cached_property
    def registrar(self) -> AnyICP:
        return icp_to(self.pair.model, self.icp)

    def built_in(self) -> dict[str, Tried]:
        starts_n = search_starts(self.before, self.pair.model)
        T_runs_n = self.pair.T_runs @ inverse(self.pair.T_init)
        first, weight = self.proposals.T_n[1], float(self.proposals.weight_n[1])
        return {
            LIKELIEST: self._tried(perf_counter() - self.repair_seconds, first, 1 - weight),
            STARTS: self._tried(perf_counter(), self._best(T_runs_n)),
            MANY_STARTS: self._tried(perf_counter(), self._best(self.registrar.register(self.before, starts_n)[0])),
        }

    def by(self, name: str, method: Callable[[Pair], Outcome], warm: bool) -> Tried:
        """Return the pose of a registration method, refined where that lowers the trimmed cost; all start alike."""
        rows = generator(*self.pair.axes, "repair", "points").permutation(len(self.before))[: self.points]
        pair = Pair(self.before[rows], self.pair.model[: self.points], seed=seed_of(*self.pair.axes, "repair", name))
        if warm:  # no time includes what a method loads or compiles
            method(pair.with_normals())
        started = perf_counter()
        outcome = method(pair.with_normals())
        # Libraries add up in an order that the alignment of memory decides.
        found_1 = outcome.T_target_source[None].round(DIGITS)
        refined_1 = self.registrar.register(self.before, found_1)[0]
        return self._tried(started, self._best(np.concatenate([found_1, refined_1])), failed=not outcome.converged)

    def by_function(self, name: str, function: Own) -> Tried:
        """Return the pose of a function of observed cloud, model and initial pose, whose doubt is its negative
        confidence; a function that abstains leaves the registered pose, which is not accepted."""
        started = perf_counter()
        answer = function(self.before.copy(), self.pair.model.copy(), np.eye(4))
        if isinstance(answer, tuple) and len(answer) != 2:
            remedy = "return a pose, or it and a confidence"
            raise InputError(f"function {name}", f"returns {len(answer)} things", remedy)
        T, confidence = answer if isinstance(answer, tuple) else (answer, 0.0)
        if T is None:
            return self._tried(started, inverse(self.pair.T_init), failed=True)
        T = require_numbers(T, (4, 4), f"pose by {name}").astype(float)
        require_rigid(T, f"pose by {name}")
        return self._tried(started, T, finite_number(name, "confidence", str(confidence), "return a number") * -1)

    def _tried(self, started: float, T: np.ndarray, doubt: float = 1.0, failed: bool = False) -> Tried:
        _, fitness_n, rmse_n = self.registrar.register(self.before, T[None], max_iterations=0)
        scores = (1 - fitness_n[0], rmse_n[0], self._trimmed_cost(T), self._spread(T), doubt)
        score_Q = np.full(len(TESTS), NEVER) if failed or not fitness_n[0] else np.array(scores).round(DIGITS)
        return T, score_Q, perf_counter() - started

    def _best(self, T_n: np.ndarray) -> np.ndarray:
        return T_n[int(np.argmin([self._trimmed_cost(T) for T in T_n]))]

    def _trimmed_cost(self, T: np.ndarray) -> float:
        squared_N = np.sort(np.square(self.surface.tree.query(transform(T, self.before))[0]))
        return float(squared_N[: max(1, int(TRIMMED * len(squared_N)))].mean())

    def _spread(self, T: np.ndarray) -> float:
        deviation_6 = np.repeat([np.deg2rad(RUN_ROTATION_DEG), RUN_TRANSLATION], 3) / np.sqrt(3)
        xi_n_6 = generator(*self.pair.axes, "repair", "spread").normal(size=(RUNS, 6)) * deviation_6
        ends_n, _, _ = self.registrar.register(self.before, exp(xi_n_6) @ T)
        return float(np.sqrt(np.square(displacements(ends_n @ inverse(T), transform(T, self.before))).mean()))
