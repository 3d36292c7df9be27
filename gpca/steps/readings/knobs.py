"""SHAP and sensitivity analysis under other readings: the knobs of Monte-Carlo ICP, run anew on some test samples."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from gpca.causes.truth import shapley_values
from gpca.evaluation.measures import ALL
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.rigid import inverse, transform
from gpca.steps.readings.files import Row, RunFiles
from gpca.steps.readings.groups import Reading
from gpca.uncertainty.designs import KNOB_RANGE, STEP, RegisteredRow, design_rows, draws_of
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, KnobRuns, Knobs
from gpca.uncertainty.settings import CORNERS, UncertaintySettings
from gpca.uncertainty.spread import divergence, log_determinant, log_residual

Pair = tuple[str, dict[str, tuple[tuple, KnobRuns]]]  # concept, and name -> clouds that are run, and their runs
# Step of each knob from the untouched pair.
STEPS = {"small": STEP * KNOB_RANGE, "middle": np.subtract(MIDDLE, UNTOUCHED)}


def sensitivity(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    settings = run_files.uncertainty()
    for source, seed, pairs in _pairs(run_files, settings.starts, "sensitivity"):
        steps = [(concept, _steps(runs["observed"], settings)) for concept, runs in pairs]
        concept_S, measured = zip(*steps, strict=True)
        for reading in readings:
            step_3 = STEPS[reading["step"]]
            values_S_K = np.array([quantities[reading["quantity"]] for quantities in measured])
            first = 1 if reading["step"] == "small" else 4
            change_S_3 = values_S_K[:, first : first + 3] - values_S_K[:, :1]
            derivative_S_3 = change_S_3 / (step_3 / KNOB_RANGE if reading["unit"] == "range" else step_3)
            value = _accuracy(np.array(concept_S), derivative_S_3, reading["sign"])
            yield reading, source, "sa_local_additive", seed, {("accuracy", ALL): value}


def shap(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    starts = sorted({reading["starts"] for reading in readings})
    for source, seed, pairs in _pairs(run_files, starts[-1], "shap"):
        cornered = [(each, {name: _corners(pair, starts) for name, pair in runs.items()}) for each, runs in pairs]
        concept_S, spreads = zip(*cornered, strict=True)
        for reading in readings:
            spread_S_8 = np.array([by_name[reading["background"]][reading["starts"]] for by_name in spreads])
            worth_S_8 = _worth(spread_S_8, reading["quantity"], reading["floor"])
            value = _accuracy(np.array(concept_S), shapley_values(worth_S_8), reading["sign"])
            yield reading, source, "shap_additive", seed, {("accuracy", ALL): value}


def magnitudes(run_files: RunFiles, readings: Sequence[Reading]) -> Iterator[Row]:
    """Accuracies of SHAP and of local sensitivity analysis by how far each knob is turned."""
    settings = run_files.uncertainty()
    turned_R_3 = np.array([[reading[name] for name in Knobs._fields] for reading in readings])
    for source, seed, pairs in _pairs(run_files, settings.starts, "knobs"):
        for method, value_R in accuracies_of_magnitudes(pairs, turned_R_3, settings.floor).items():
            for reading, value in zip(readings, value_R, strict=True):
                yield reading, source, method, seed, {("accuracy", ALL): float(value)}


def accuracies_of_magnitudes(pairs: Iterable[Pair], turned_R_3: np.ndarray, floor: float) -> dict[str, np.ndarray]:
    """Accuracies (R,) of SHAP and of local sensitivity analysis, by the settings to which the knobs are turned."""
    concept_S, worths = [], []
    for concept, runs in pairs:
        concept_S.append(concept)
        (_, _, _, T_ref), knob_runs = runs["observed"]
        turned = (Knobs(*np.where(on, turned_3, UNTOUCHED)) for turned_3 in turned_R_3 for on in CORNERS)
        spread = np.array([knob_runs.runs(corner)[0].covariance(T_ref) for corner in turned])
        worths.append(_worth(spread.reshape(len(turned_R_3), len(CORNERS), 6, 6), "divergence", floor))
    worth_R_S_8, step_R_1_3 = np.array(worths).swapaxes(0, 1), ((turned_R_3 - UNTOUCHED) / KNOB_RANGE)[:, None]
    values_R_S_3 = {
        "shap_additive": np.array([shapley_values(worth_S_8) for worth_S_8 in worth_R_S_8]),
        "sa_local_additive": (worth_R_S_8[:, :, [1, 2, 4]] - worth_R_S_8[:, :, :1]) / step_R_1_3,
    }
    return {
        method: np.array([_accuracy(np.array(concept_S), values_S_3, "signed") for values_S_3 in of_method])
        for method, of_method in values_R_S_3.items()
    }


def _pairs(run_files: RunFiles, starts: int, title: str) -> Iterator[tuple[str, int, Iterator[Pair]]]:
    """Source, seed and the pairs of its samples, by the random numbers of the protocol."""
    for source, seed, registrations in run_files.loaded():
        chosen = registrations.subset(design_rows(registrations, "additive", run_files.sizes.samples))
        title_of = f"{title} of {source}, seed {seed}"
        yield source, seed, runs_of(chosen, source, seed, run_files.uncertainty(), starts, title_of)


def runs_of(
    registrations: Registrations, source: str, seed: int, settings: UncertaintySettings, starts: int, title: str
) -> Iterator[Pair]:
    """Concept of each registration, and its Monte-Carlo ICP by pair: the observed one, and a clean one."""
    observed = registrations.without_labels()
    for row in progress(range(len(registrations)), title):
        draws = draws_of(observed, row, source, seed, replace(settings, starts=starts))
        points, pair = settings.icp_points, RegisteredRow(observed, row)
        by_name = {"observed": pair.observed(points, draws.random), "clean": pair.clean(points)}
        made = {name: (clouds, KnobRuns(clouds, draws)) for name, clouds in by_name.items()}
        yield str(registrations.concept[row]), made


def _steps(pair: tuple, settings: UncertaintySettings) -> dict[str, np.ndarray]:
    """Every quantity of the untouched pair, after each small step, and after each step to the middle, (7,)."""
    (_, target, _, T_ref), knob_runs = pair
    untouched = np.array(UNTOUCHED)
    conditions = [untouched] + [untouched + step_3 * knob for step_3 in STEPS.values() for knob in np.eye(3)]
    moved = [knob_runs.runs(Knobs(*condition)) for condition in conditions]
    spread_K = np.array([runs.covariance(T_ref) for runs, _ in moved])
    distance = settings.icp.correspondence_distance
    best = [(runs.T_target_source_n[runs.cost_n(distance).argmin()], cKDTree(source)) for runs, source in moved]
    return {quantity: _worth(spread_K, quantity, settings.floor) for quantity in WORTHS} | {
        "trace": np.trace(spread_K, axis1=1, axis2=2),
        "residual": np.array([log_residual(transform(inverse(T), target), tree) for T, tree in best]),
        "inlier_rmse": np.array([runs.inlier_rmse_n.mean() for runs, _ in moved]),
        "inlier_rmse_of_one": np.array([runs.inlier_rmse_n[0] for runs, _ in moved]),
    }


def _corners(pair: tuple, starts: Sequence[int]) -> dict[int, np.ndarray]:
    """Covariances (8, 6, 6) of the corners of the knobs' middle, by the number of first starts."""
    (_, _, _, T_ref), knob_runs = pair
    corners = [knob_runs.runs(Knobs(*np.where(switches, MIDDLE, UNTOUCHED)))[0] for switches in CORNERS]
    return {n: np.array([runs.chosen(np.arange(n)).covariance(T_ref) for runs in corners]) for n in starts}


WORTHS: dict[str, Callable[[np.ndarray, np.ndarray, float], np.ndarray]] = {
    "divergence": divergence,
    "divergence_reversed": lambda clean, spread, floor: divergence(spread, np.broadcast_to(clean, spread.shape), floor),
    "log_determinant": lambda clean, spread, floor: log_determinant(spread, floor),
}


def _worth(spread_K: np.ndarray, quantity: str, floor: float) -> np.ndarray:
    """Uncertainty (…, K) of covariances (…, K, 6, 6), of which the first is the untouched pair's."""
    return WORTHS[quantity](spread_K[..., :1, :, :], spread_K, floor)


def _accuracy(concept_S: np.ndarray, values_S_3: np.ndarray, sign: str) -> float:
    """Share of samples whose concept has the value that counts; where all are equal, none is named."""
    signed_S_3 = {"signed": values_S_3, "absolute": np.abs(values_S_3), "lowest": -values_S_3}[sign]
    named_S = np.array(CONCEPTS)[signed_S_3.argmax(axis=1)]
    return float(np.mean((named_S == concept_S) & (np.ptp(values_S_3, axis=1) > 0)))
