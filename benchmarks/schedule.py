"""Jobs of Snakemake's plan on several cores: when the last one ends, and the chain of jobs that no core shortens."""

import heapq
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Job:
    """A job of the plan: files read and written, its benchmark file (relative to the run), how it is scheduled."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    benchmark: str
    priority: int
    threads: int
    rule: str = ""


def wall_time(jobs: Iterable[Job], seconds: Mapping[str, float], cores: int) -> float:
    """Return the seconds until the last job ends, where each starts once its inputs are there and its cores free.

    Of those that could start, the higher priority goes first, then the longer job.
    """
    waiting = {job.benchmark: job for job in jobs}
    lacks, readers = _needs(waiting.values())
    ready = [_rank(job, seconds) for job in waiting.values() if not lacks[job.benchmark]]
    heapq.heapify(ready)
    running: list[tuple[float, str]] = []
    now, free = 0.0, cores
    while ready or running:
        set_aside = []
        while ready and free:
            rank = heapq.heappop(ready)
            job = waiting[rank[-1]]
            if min(job.threads, cores) > free:
                set_aside.append(rank)
                continue
            free -= min(job.threads, cores)
            heapq.heappush(running, (now + seconds[job.benchmark], job.benchmark))
        for rank in set_aside:
            heapq.heappush(ready, rank)
        now, ended = heapq.heappop(running)
        free += min(waiting[ended].threads, cores)
        for name in readers[ended]:
            lacks[name].discard(ended)
            if not lacks[name]:
                heapq.heappush(ready, _rank(waiting[name], seconds))
    return now


def critical_path(jobs: Iterable[Job], seconds: Mapping[str, float]) -> list[Job]:
    """Return the longest chain of jobs that wait for each other, first to last."""
    of = {job.benchmark: job for job in jobs}
    lacks, readers = _needs(of.values())
    before: dict[str, str | None] = {}
    until = dict.fromkeys(of, 0.0)
    ready = [name for name in of if not lacks[name]]
    while ready:
        name = ready.pop()
        before.setdefault(name, None)
        until[name] += seconds[name]
        for reader in readers[name]:
            if reader not in before or until[name] > until[reader]:
                before[reader], until[reader] = name, until[name]
            lacks[reader].discard(name)
            if not lacks[reader]:
                ready.append(reader)
    chain, last = [], max(until, key=until.__getitem__, default=None)
    while last is not None:
        chain.append(of[last])
        last = before[last]
    return chain[::-1]


def _rank(job: Job, seconds: Mapping[str, float]) -> tuple[float, float, str]:
    return -job.priority, -seconds[job.benchmark], job.benchmark


def _needs(jobs: Iterable[Job]) -> tuple[dict[str, set[str]], dict[str, set[str]]]:
    """The jobs that each waits for, and those that wait for it, by the names of their benchmark files."""
    jobs = list(jobs)
    maker = {path: job.benchmark for job in jobs for path in job.outputs}
    lacks = {job.benchmark: {maker[path] for path in job.inputs if path in maker} for job in jobs}
    readers: dict[str, set[str]] = defaultdict(set)
    for name, makers in lacks.items():
        for made_by in makers:
            readers[made_by].add(name)
    return lacks, readers
