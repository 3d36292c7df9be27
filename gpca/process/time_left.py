"""The time left of a run: of a job, the mean of its rule in a measured run (`TIMES`), else that of all other jobs."""

import csv
import logging
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from statistics import fmean
from time import monotonic
from typing import Any

TIMES = Path(__file__).parents[2] / "workflow/measured_times.csv"  # python benchmarks/scale.py results/{run} --times
USUAL_RUN = "default"  # gives the relative times for a run that was never measured
EVERY_S = 20.0  # between two lines
TRUST_S = 120.0  # core time after which the speeds of this and the measured machine have equal weight


class TimeLeft(logging.Handler):
    """Says how long the work left takes, on one-core jobs side by side, after Snakemake's counts of jobs."""

    def __init__(
        self,
        expected: Mapping[str, float],
        cores: int,
        has_ended: Callable[[str], bool],
        say: Callable[[str], object],
        trust_s: float = TRUST_S,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        super().__init__(logging.INFO)
        self._left, self._cores, self._has_ended, self._say, self._clock = dict(expected), cores, has_ended, say, clock
        self._expected_s = self._took_s = trust_s
        self._reported_s = clock()

    def seconds(self) -> float:
        """Return the expected seconds of the work per core, or the longest job, at the speed so far."""
        longest_s = max(self._left.values(), default=0.0)
        return max(sum(self._left.values()) / self._cores, longest_s) * self._took_s / self._expected_s

    def emit(self, record: logging.LogRecord) -> None:
        """Handle a message of Snakemake; all but its counts of jobs are ignored."""
        if getattr(record, "event", None) != "progress" or self._clock() - self._reported_s < EVERY_S:
            return
        self._reported_s = self._clock()
        for job in [*filter(self._has_ended, self._left)]:
            expected_s, took_s = self._left.pop(job), seconds_of(job)
            if took_s is not None:
                self._expected_s += expected_s
                self._took_s += took_s
        self._say(in_words(self.seconds()))


def tell_time_left(workflow: Any, run: str) -> None:
    """Print the time left during a run, unless none of its jobs was ever measured; `workflow` is Snakemake's object."""
    from snakemake.logging import logger
    from snakemake.settings.enums import Quietness

    times = read_times(TIMES)
    by_rule = times.get(run, times.get(USUAL_RUN, {}))
    jobs = {str(job.benchmark): job for job in workflow.dag.needrun_jobs() if job.benchmark}
    known = {path: by_rule[job.rule.name] for path, job in jobs.items() if job.rule.name in by_rule}
    if not known:
        return
    expected = dict.fromkeys(jobs, fmean(known.values())) | known
    side_by_side = workflow.cores if workflow.local_exec else workflow.nodes
    cores = max(1, min(int(side_by_side or 1), len(jobs)))
    say = partial(logger.info, extra={"quietness": Quietness.PROGRESS})
    trust_s = TRUST_S if run in times else 1.0
    time_left = TimeLeft(expected, cores, lambda path: workflow.dag.finished(jobs[path]), say, trust_s)
    if run in times:
        say(in_words(time_left.seconds()))
    logger.addHandler(time_left)


def seconds_of(benchmark: str | Path) -> float | None:
    """Return the seconds in a benchmark file, summed over repeats; None without them."""
    try:
        rows = list(csv.DictReader(Path(benchmark).read_text(encoding="utf-8").splitlines(), delimiter="\t"))
        return sum(float(row["s"]) for row in rows) if rows else None
    except (OSError, KeyError, TypeError, ValueError):  # incomplete, or of another program
        return None


def read_times(path: Path) -> dict[str, dict[str, float]]:
    """Return run -> rule -> mean seconds of its jobs; empty without the file."""
    times: dict[str, dict[str, float]] = {}
    if path.is_file():
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                times.setdefault(row["run"], {})[row["rule"]] = float(row["seconds"])
    return times


def in_words(seconds: float) -> str:
    """Return a line such as ``about 35 minutes left``."""
    minutes = round(seconds / 60)
    if minutes < 1:
        return "less than a minute left"
    if minutes < 120:
        return f"about {minutes} minute{'s' * (minutes > 1)} left"
    return f"about {seconds / 3600:.1f} hours left"
