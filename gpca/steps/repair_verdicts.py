"""Step ``repair_verdicts``: which poses are accepted, by judges and limits of other families (Table XX)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logit

from gpca.guarantee.acceptance import accepted_below, accepted_in_hindsight
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.model.diagnoser import threshold_of
from gpca.model.proposed import with_repair
from gpca.model.repair import REPAIRED, SEVERAL, decide
from gpca.model.result import EVEN, Calibrated, ResultJudge
from gpca.seeds import seed_of_file
from gpca.steps.repair import REPAIR, TESTS, Attempts

CAUSES, HARD = "causes", "hard"  # tracks whose families judges and limits come from; and that share these
JUDGED = "judged"  # after a rival's name: its pose is accepted by the judge
FALSE_ALARMS = 0.05  # share of the good registrations of other families that are called failed
OF_SAMPLE = ("sample", "group", "cluster", "label", "points", "start_error")
NAMED = ("track", "source", "seed", *OF_SAMPLE, "method")
COLUMNS = ("failed", "called", "replaced", "right", "right_pose", "several")
SCORE = "score"  # by which a pose is accepted; the smaller, the surer


@dataclass(frozen=True)
class Limits:
    """What one fold's families tell: the judge, its level, and the test and limit by which each rival is accepted."""

    judge: ResultJudge
    level: Calibrated
    tests: Mapping[str, tuple[int, float | None]]  # of a rival: the number of its test, or of the judge; its limit


def verdicts(attempts: Mapping[str, Sequence[tuple[str, int, Attempts]]], tolerance: float) -> Frame:
    """Return a row for each registration and method, given source, seed and attempts by track."""
    import pandas as pd

    learned = Attempts.joined([each for _, _, each in attempts[CAUSES]])
    limits_of: dict[str, Limits] = {}
    for seen, unseen in learned.proposed.folds():
        limits = learn_limits(learned.subset(seen), tolerance)
        limits_of |= dict.fromkeys(learned.family_N[unseen].tolist(), limits)
    every = learn_limits(learned, tolerance)
    records = []
    for track, files in attempts.items():
        for source, seed, each in files:
            for row, family in enumerate(each.family_N.tolist()):
                limits = limits_of.get(family, every) if track in (CAUSES, HARD) else every
                for method, outcome in decided(each, row, limits, tolerance):
                    described = (getattr(each, f"{name}_N")[row] for name in OF_SAMPLE)
                    records.append((track, source, seed, *described, method, *outcome))
    return pd.DataFrame(records, columns=[*NAMED, *COLUMNS, SCORE])


def learn_limits(learned: Attempts, tolerance: float) -> Limits:
    """Learn from registrations of some families; judges of others of these set the limits."""
    proposed, rivals = learned.proposed, learned.rivals
    result_N, judged_N_M = np.zeros(len(learned)), np.zeros(rivals.error_N_P.shape)
    for seen, unseen in proposed.folds():
        judge = proposed.subset(seen).judge()
        result_N[unseen] = proposed.subset(unseen).probabilities(judge, tolerance)[:, 0]
        judged_N_M[unseen] = rivals.subset(unseen).probabilities(judge, tolerance)
    off_N = proposed.error_N_P[:, 0] > tolerance
    threshold = EVEN if off_N.all() else threshold_of(result_N[~off_N], FALSE_ALARMS)
    [level] = with_repair([Calibrated(tolerance, threshold)], proposed)
    if level.repaired_below is None:  # nothing is
        level = replace(level, repaired_below=0.0)
    called, tests = np.flatnonzero(result_N >= threshold), {}
    for m, name in enumerate(learned.method_M.tolist()):
        wrong_n = rivals.error_N_P[called, m] > tolerance
        family_n, score_n_Q = learned.family_N[called], learned.score_N_M_Q[called, m]
        below_Q = [accepted_below(score_n, wrong_n, family_n) for score_n in score_n_Q.T]
        # The test that would repair most there, were its limit known.
        once, repaired_n = np.ones((1, len(called))), ~wrong_n & off_N[called]
        accepted_Q_n = [accepted_in_hindsight(score_n, wrong_n, once)[0] for score_n in score_n_Q.T]
        best = int(np.argmax([(accepted_n & repaired_n).sum() for accepted_n in accepted_Q_n]))
        tests[name] = best, below_Q[best]
        judged_n = judged_N_M[called, m]
        tests[f"{name}_{JUDGED}"] = len(TESTS), accepted_below(judged_n, wrong_n, family_n)
    return Limits(proposed.judge(), level, tests)


def decided(each: Attempts, row: int, limits: Limits, tolerance: float) -> Iterator[tuple[str, tuple]]:
    """Yield `COLUMNS` of repair and of every rival, for one registration."""
    alone = each.subset(np.array([row]))
    proposed, rivals = alone.proposed, alone.rivals
    error_P, error_M = proposed.error_N_P[0], rivals.error_N_P[0]
    verdict = decide(limits.judge, limits.level, proposed.at(0), tolerance)
    failed, called = bool(error_P[0] > tolerance), bool(verdict.probability_n[0] >= limits.level.threshold)
    right_P = error_P <= tolerance
    replaced, best = verdict.name == REPAIRED, 1 + int(verdict.probability_n[1:].argmin())
    several = verdict.name == SEVERAL and bool(right_P[list(verdict.rows)].any())
    right = bool(right_P[best])
    yield REPAIR, (failed, called, replaced, replaced and right, right, several, log_odds(verdict.probability_n[best]))
    judged_M = rivals.probabilities(limits.judge, tolerance)[0]
    for m, name in enumerate(each.method_M.tolist()):
        for method in (name, f"{name}_{JUDGED}"):
            test, below = limits.tests[method]
            by_judge = test == len(TESTS)
            score = float(judged_M[m] if by_judge else alone.score_N_M_Q[0, m, test])
            replaced, right = bool(called and below is not None and score < below), bool(error_M[m] <= tolerance)
            shown = log_odds(score) if by_judge else score
            yield method, (failed, called, replaced, replaced and right, right, False, shown)


def log_odds(probability: float) -> float:  # keeps the order of small probabilities in a file of few decimals
    return float(logit(np.clip(probability, 1e-12, 1 - 1e-12)))


def run(job: Job) -> None:
    """Decide on the attempts of all tracks -> ``repairs/verdicts.csv``."""
    with record_provenance([job.verdicts], job.attempts, job.settings):
        attempts: dict[str, list[tuple[str, int, Attempts]]] = {}
        for path in job.attempts:
            axes = path.parent.name, seed_of_file(path)
            attempts.setdefault(path.parts[-3], []).append((*axes, Attempts.load(path, axes)))
        write_csv(job.verdicts, verdicts(attempts, job.settings["tolerance"]), form="%.9g")
