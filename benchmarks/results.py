"""Judge results of unseen families at several tolerances, beside gates and the untrained re-enactment.

    python benchmarks/results.py CAUSES:REENACTMENTS … [NAME=CAUSES:REENACTMENTS …]

Each argument names two files of a run, such as results/full/model_causes/ycb/seed0.npz and the file of the same name
below model_reenactments/. docs/appendix.md has the protocol. `clear` leaves out errors between two thirds of the
tolerance and the tolerance; `far` are starts that are 30 to 60° off, and what has a name is shown apart. The mean over
the starts is judged by its own alarm. The last line is a JSON object of the trained judge at 3 %: samples,
good, families, auroc, auroc_clear, false_alarms, missed, covered (by sets of 90 %), and each again for far starts, as
far_…, and for each name, as NAME_….
"""

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.causes.dataset import Causes  # noqa: E402
from gpca.causes.judged import ranking  # noqa: E402
from gpca.causes.truth import BORDERLINE, NOMINAL  # noqa: E402
from gpca.classifier.settings import GPCSettings  # noqa: E402
from gpca.evaluation.conformal import ALARM, GOOD, calibrate_alarm  # noqa: E402
from gpca.evaluation.intervals import Estimate, interval, pigeonhole_weights, weighted_mean  # noqa: E402
from gpca.explainers.pair_classifier import Judgment  # noqa: E402
from gpca.guarantee.guarantee import STATES, calibrate  # noqa: E402
from gpca.model.diagnoser import TrainingSet, judged_unseen  # noqa: E402
from gpca.model.diagnosis import state_probabilities  # noqa: E402
from gpca.model.result import DEFAULT_TOLERANCE, TOLERANCES, ResultJudge  # noqa: E402
from gpca.reenactment.dataset import Reenactments  # noqa: E402
from gpca.rigid import inverse, rotation_angle_rad  # noqa: E402
from gpca.seeds import generator  # noqa: E402

FOLDS = 5  # of the families
CLEAR = 2 / 3  # of the tolerance
FAR_DEG = 30.0, 60.0
FAR = "far"
JUDGE, UNTRAINED, START, GATES = "result", "untrained", "mean over starts", ("fitness", "inlier_rmse")
JUDGES: dict[tuple[int, bytes], ResultJudge] = {}
CLASSIFIER = GPCSettings(learning_rate=0.1, iterations=200)  # the config's model.classifier


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", help="[NAME=]CAUSES:REENACTMENTS")
    sets, angles, names = [], [], []
    for pair in parser.parse_args(arguments).pairs:
        name, _, paths = pair.rpartition("=")
        causes_path, reenactments_path = map(Path, paths.split(":"))
        causes = Causes.load(causes_path)
        sets.append(TrainingSet.of(causes, Reenactments.load(reenactments_path, causes.registrations)))
        names += [name] * len(causes)
        angles += [start_angle_deg(causes, row) for row in range(len(causes))]
    samples, angle_N, name_N = TrainingSet.joined(sets), np.array(angles), np.array(names)
    shown = {name: name_N == name for name in dict.fromkeys(["", *names])}
    shown[FAR] = (angle_N >= FAR_DEG[0]) & (angle_N <= FAR_DEG[1]) & shown[""]
    print(
        "Promised: at most 5 % of good results called failed, and of failures called good. 95 % intervals in brackets."
    )
    result: dict[str, float] = {}
    unseen, result_T_N = judged_unseen(samples, CLASSIFIER, "results")
    for tolerance, result_N in zip(TOLERANCES, result_T_N, strict=True):
        judged = judge_unseen(samples, tolerance)
        judged[START], covered_N = start_and_sets(samples, unseen, result_N, tolerance)
        for name, mask_N in shown.items():
            if not mask_N.any():
                continue
            found = measured(samples, judged, tolerance, np.flatnonzero(mask_N), name, covered_N)
            if tolerance == DEFAULT_TOLERANCE:
                result |= found
    print(json.dumps(result))


def start_angle_deg(causes: Causes, row: int) -> float:
    T_true, T_init = (causes.registrations.T_target_source(name, row) for name in ("true", "init"))
    return float(np.rad2deg(rotation_angle_rad(T_true @ inverse(T_init))))


def judge_unseen(samples: TrainingSet, tolerance: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return scores (N,) and calls (N,) of each method, by what learned and was calibrated on other families."""
    off_N = samples.shown_error_N > tolerance
    fixed = {
        UNTRAINED: ResultJudge.untrained().probability(samples, tolerance),
        "fitness": -samples.fitness_N,
        "inlier_rmse": samples.inlier_rmse_N,
    }
    scores = {name: score_N.astype(float) for name, score_N in fixed.items()} | {JUDGE: np.empty(len(off_N))}
    calls = {name: np.empty(len(off_N), object) for name in scores}

    for learned, tested in folds(samples.family_N):
        inner = {name: score_N[learned] for name, score_N in fixed.items()} | {JUDGE: np.empty(len(learned))}
        for first, second in folds(samples.family_N[learned]):
            inner[JUDGE][second] = judgment(samples, learned[first], learned[second], tolerance)
        scores[JUDGE][tested] = judgment(samples, learned, tested, tolerance)
        for name, score_n in inner.items():
            calls[name][tested] = calibrate_alarm(score_n, off_N[learned]).of(scores[name][tested])
    return {name: (scores[name], calls[name]) for name in (JUDGE, UNTRAINED, *GATES)}


def start_and_sets(
    samples: TrainingSet, unseen: Judgment, result_N: np.ndarray, tolerance: float
) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Return scores and calls (N,) of the starts, and whether sets hold the states (N,), by limits of other
    families."""
    failure_N, state_N, known_N = unseen.failure_N, samples.states_within(tolerance), samples.label_N != BORDERLINE
    scores_N_5 = state_probabilities(unseen.causes_N_3, result_N)
    call_N, covered_N = np.empty(len(state_N), object), np.empty(len(state_N), bool)
    for others, tested in folds(samples.family_N):
        guarantee = calibrate(scores_N_5[others], state_N[others], samples.family_N[others])
        inside_n_5 = guarantee.sets(scores_N_5[tested])
        covered_N[tested] = (inside_n_5 & (state_N[tested, None] == np.array(STATES))).any(axis=1)
        known = others[known_N[others]]
        call_N[tested] = calibrate_alarm(failure_N[known], samples.label_N[known] != NOMINAL).of(failure_N[tested])
    return (failure_N, call_N), covered_N


def folds(family_N: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    from sklearn.model_selection import GroupKFold

    yield from GroupKFold(FOLDS).split(family_N, groups=family_N)


def judgment(samples: TrainingSet, learned: np.ndarray, asked: np.ndarray, tolerance: float) -> np.ndarray:
    if (key := (id(samples), learned.tobytes())) not in JUDGES:  # one learns at all tolerances
        JUDGES[key] = samples.subset(learned).judge()
    return samples.subset(asked).probabilities(JUDGES[key], tolerance)


def measured(
    samples: TrainingSet,
    judged: dict[str, tuple[np.ndarray, np.ndarray]],
    tolerance: float,
    rows: np.ndarray,
    shown: str,
    covered_N: np.ndarray | None = None,
) -> dict[str, float]:
    """Print the measures of all methods on some rows, and return those of the trained judge."""
    error_N, family_N = samples.shown_error_N[rows], samples.family_N[rows]
    off_N, clear_N = error_N > tolerance, (error_N > tolerance) | (error_N <= CLEAR * tolerance)
    weights_B_N = np.concatenate([np.ones((1, len(rows))), pigeonhole_weights(generator("results"), family_N)])
    counts = {"samples": len(rows), "good": int((~off_N).sum()), "families": len(set(family_N.tolist()))}
    title = ", ".join(f"{number} {name}" for name, number in counts.items())
    print(f"\ntolerance {100 * tolerance:g} %{shown and ', ' + shown}: {title}")
    rows_of = {}
    for name, (score_N, call_N) in judged.items():
        score_n, call_n = score_N[rows], call_N[rows]
        shares = {"false_alarms": (call_n == ALARM, ~off_N), "missed": (call_n == GOOD, off_N)}
        if name == JUDGE and covered_N is not None:
            shares["covered"] = covered_N[rows], np.ones(len(rows), bool)
        rows_of[name] = {
            "auroc": interval(ranking(score_n, off_N, weights_B_N)["area"]),
            "auroc_clear": interval(ranking(score_n, off_N, weights_B_N * clear_N)["area"]),
        } | {
            measure: interval(
                weighted_mean(wrong_n[among_n].astype(float), weights_B_N[:, among_n]), weights_B_N[1:, among_n]
            )
            for measure, (wrong_n, among_n) in shares.items()
        }
    gate = max(GATES, key=lambda name: rows_of[name]["auroc"].value)
    for name, measures in rows_of.items():
        print(
            f"  {name + ' (best gate)' * (name == gate):24}", "  ".join(f"{m} {cell(e)}" for m, e in measures.items())
        )
    own = {measure: round(estimate.value, 4) for measure, estimate in rows_of[JUDGE].items()}
    return {(shown and f"{shown}_") + name: value for name, value in (counts | own).items()}


def cell(estimate: Estimate) -> str:
    return f"{estimate.value:.3f} [{estimate.low:.3f}, {estimate.high:.3f}]"


if __name__ == "__main__":
    main()
