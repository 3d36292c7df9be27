"""What a run scales to: more cores for the same run, and more datasets, seeds and explainers on a cluster.

    python benchmarks/scale.py results/full [--configfile config/full.yaml] [--config data_dir=/data] [--cores 1 2 4 8]
    python benchmarks/scale.py results/full --sources 100 --seeds 10 --explainers 20 [--write docs/appendix.md]
    python benchmarks/scale.py results/default --expect config/full.yaml [--given train_encoder=2x readings/pool=90s]
    python benchmarks/scale.py results/full --expect config/full.yaml --means
    python benchmarks/scale.py results/default --times

The first form schedules the jobs of a finished run, each with the seconds of its benchmark file, on several
numbers of cores (Snakemake's own start and the cores' shared memory are not in it), and names the chain of jobs that no
core shortens; --rules 10 adds the rules that take most. The second plans the default run with so many datasets (copies
of its own), seeds and explainers, dry, and takes the core time and memory of that plan. A job of the plan takes the
mean seconds of its rule in the finished run, in proportion to the results that it reads and writes: many jobs loop over
the seeds. A rule that was not measured counts as the mean of the others, in the queue or out of it. Transfer between
datasets is left out, as its cost grows with the square of their number. The third schedules another config before it is
run, with jobs that grow in the same way. Where its sizes differ too, --given says by what factor the jobs of a rule or
a benchmark file grow besides, or how many seconds they take; names may be patterns, and the last one that fits counts.
With --means the run need not be there: its jobs take the mean seconds of their rule in workflow/measured_times.csv.
--write puts the tables between the comments that the page has for the run, --times the mean seconds of each rule into
workflow/measured_times.csv, by which a run tells its time left. The last line is a JSON object: speedup_<cores>,
critical_s, core_min; and jobs, submitted, core_h, longest_s, results, plan_s, plan_mb.
"""

import argparse
import csv
import json
import re
import resource
import sys
import tempfile
import textwrap
from collections import defaultdict
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from itertools import cycle, islice
from pathlib import Path
from statistics import fmean

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from benchmarks import markdown  # noqa: E402 (the script runs from a plain checkout)
from benchmarks.pipeline import SIDECAR, number  # noqa: E402
from benchmarks.schedule import Job, critical_path, wall_time  # noqa: E402
from benchmarks.targets import name_of_run, parser_of_run, plan, read_plan  # noqa: E402
from gpca.declarations.registry import experiments  # noqa: E402
from gpca.errors import InputError  # noqa: E402
from gpca.io.files import whole_file  # noqa: E402
from gpca.process.time_left import TIMES, read_times  # noqa: E402

RUN = "scale"
SLOTS = (50, 500)  # jobs of a cluster at once
LINE = 120  # letters of a page
WAIT_S = 10.0  # that a submitted job takes besides its work: the queue's turn, and Snakemake once more on the node


def main(arguments: list[str] | None = None) -> int:
    parser = parser_of_run(__doc__)
    parser.add_argument("--cores", type=int, nargs="+", default=[1, 2, 4, 8, 16], help="default 1 2 4 8 16")
    parser.add_argument("--rules", type=int, default=0, help="show the rules that take most, so many; default none")
    parser.add_argument("--expect", type=Path, metavar="CONFIG", help="config of a run that has not been made")
    parser.add_argument("--means", action="store_true", help="with --expect, take the times that the checkout keeps")
    parser.add_argument("--given", nargs="+", default=[], metavar="NAME=VALUE", help="factor (2x) or seconds (90s)")
    parser.add_argument(
        "--sources", type=int, default=0, help="number of datasets of the larger run; by default none is planned"
    )
    parser.add_argument("--seeds", type=int, default=10, help="number of seeds of the larger run, default 10")
    parser.add_argument("--explainers", type=int, default=20, help="number of explainers of the larger run, default 20")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="Markdown page with a place for the tables")
    parser.add_argument("--times", action="store_true", help="write the mean seconds of each rule for later runs")
    options = parser.parse_args(arguments)
    try:
        run = options.folder.name if options.means else name_of_run(options.folder)
        expected = read_plan(plan(RUN, options.expect, []), RUN) if options.expect else []
        jobs = expected if options.means else read_plan(plan(run, options.configfile, options.config), run)
        seconds = of_rules(jobs, run) if options.means else measured(jobs, options.folder)
        if options.times:
            write_times(TIMES, run, jobs, seconds)
        planned, taken = jobs, seconds
        if options.expect:
            planned = expected
            taken = given(planned, seconds if options.means else estimated(jobs, seconds, planned), options.given)
        lines, found = on_cores(planned, taken, options.cores)
        if options.rules:
            lines += ["", *by_rules(planned, taken, options.rules)]
        if options.sources:
            more, found_more = on_a_cluster(jobs, seconds, options)
            lines, found = [*lines, "", *more], found | found_more
        if options.write:
            markdown.write_between(options.write, f"results/{run} at scale", lines)
    except InputError as fault:
        print(f"scale: {fault}", file=sys.stderr)
        return 2
    print("\n".join(lines))
    print(json.dumps(found))
    return 0


def measured(jobs: Sequence[Job], folder: Path) -> dict[str, float]:
    """Return the seconds of each job of the run: of the whole job, or else of the work that its provenance tells.

    Raises:
        InputError: one of them has neither.
    """
    seconds = {}
    for job in jobs:
        path = folder / job.benchmark
        records = [folder / f"{output}{SIDECAR}" for output in job.outputs]
        blocks = {record.read_bytes(): record for record in records if record.is_file()}  # one may stand beside several
        if path.is_file():
            seconds[job.benchmark] = sum(number(path, "s"))
        elif blocks:
            seconds[job.benchmark] = sum(value for record in blocks.values() for value in number(record, "seconds"))
        else:
            raise InputError(folder, f"has no {job.benchmark}", "finish the run, or give its --configfile and --config")
    return seconds


def of_rules(jobs: Sequence[Job], run: str) -> dict[str, float]:
    """Return the seconds of each job: the mean of its rule in a run, or else in any; of all rules if in none."""
    times = read_times(TIMES)
    if run not in times:
        raise InputError(TIMES, f"has no times of a run {run}", f"give one of {', '.join(times)}")
    others = {rule: mean_s for by_rule in times.values() for rule, mean_s in by_rule.items()}
    mean_s = fmean(times[run].values())
    return {job.benchmark: times[run].get(job.rule, others.get(job.rule, mean_s)) for job in jobs}


def write_times(path: Path, run: str, jobs: Sequence[Job], seconds: Mapping[str, float]) -> None:
    """Write the mean seconds of each rule of a run into a table, beside those of other runs."""
    of_rule = defaultdict(list)
    for job in jobs:
        of_rule[job.rule].append(seconds[job.benchmark])
    times = read_times(path) | {run: {rule: fmean(values) for rule, values in sorted(of_rule.items())}}
    with whole_file(path) as half, half.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["run", "rule", "seconds"])
        for name, by_rule in sorted(times.items()):
            writer.writerows([name, rule, f"{mean_s:.2f}"] for rule, mean_s in by_rule.items())


def on_cores(jobs: Sequence[Job], seconds: Mapping[str, float], cores: Sequence[int]) -> tuple[list[str], dict]:
    """Return the table of wall times by number of cores with the critical path, and their numbers."""
    alone_s = wall_time(jobs, seconds, 1)
    walls_s = {count: wall_time(jobs, seconds, count) for count in cores}
    rows = [[count, f"{wall_s / 60:.1f}", f"{alone_s / wall_s:.1f}"] for count, wall_s in walls_s.items()]
    chain = critical_path(jobs, seconds)
    critical_s = sum(seconds[job.benchmark] for job in chain)
    steps = " → ".join(f"`{job.rule}` {seconds[job.benchmark]:.0f}" for job in chain)
    lines = markdown.table(["cores", "wall time (min)", "times as fast as one core"], rows)
    sentence = f"The longest chain of jobs takes {critical_s / 60:.1f} minutes (in seconds: {steps})."
    lines += ["", *textwrap.wrap(sentence, LINE)]
    speedups = {f"speedup_{count}": round(alone_s / wall_s, 2) for count, wall_s in walls_s.items()}
    return lines, speedups | {"critical_s": round(critical_s, 1), "core_min": round(alone_s / 60, 1)}


def by_rules(jobs: Sequence[Job], seconds: Mapping[str, float], most: int) -> list[str]:
    """Return the table of the rules that take most, with the number of their jobs and the longest one."""
    of_rule: dict[str, list[float]] = defaultdict(list)
    for job in jobs:
        of_rule[job.rule].append(seconds[job.benchmark])
    longest = sorted(of_rule.items(), key=lambda item: -sum(item[1]))[:most]
    rows = [[f"`{rule}`", len(own), f"{sum(own) / 60:.1f}", f"{max(own) / 60:.1f}"] for rule, own in longest]
    return markdown.table(["rule", "jobs", "core time (min)", "longest job (min)"], rows)


def given(jobs: Sequence[Job], seconds: Mapping[str, float], values: Sequence[str]) -> dict[str, float]:
    """Return the seconds with those of some jobs multiplied or replaced.

    Args:
        values: ``name=2x`` or ``name=90s``, of a rule or of a benchmark file without folder and ending, or a pattern.

    Raises:
        InputError: another form, or a name that no job has.
    """
    changed = dict(seconds)
    for text in values:
        form = re.fullmatch(r"(.+)=(\d+(?:\.\d+)?)([sx])", text)
        if not form:
            raise InputError(f"--given {text}", "is no factor or time", "give such as pool=2x or pool=90s")
        name, number_of, unit = form.groups()
        meant = [job.benchmark for job in jobs if fnmatchcase(job.rule, name) or fnmatchcase(_path(job), name)]
        if not meant:
            raise InputError(f"--given {text}", "names no job of the plan", "name a rule, or a benchmark file")
        changed |= {job: float(number_of) * (seconds[job] if unit == "x" else 1) for job in meant}
    return changed


def _path(job: Job) -> str:
    return job.benchmark.removeprefix("benchmarks/").removesuffix(".tsv")


def on_a_cluster(
    jobs: Sequence[Job], seconds: Mapping[str, float], options: argparse.Namespace
) -> tuple[list[str], dict]:
    """Return the table of the larger run, planned dry, and its numbers."""
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder, "scale.json")
        config.write_text(json.dumps(larger_config(options.sources, options.seeds, options.explainers)))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        text = plan(RUN, config, [])
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    plan_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    plan_mb = after.ru_maxrss / 1024
    larger = read_plan(text, RUN)
    expected = estimated(jobs, seconds, larger)
    submitted = [job for job in larger if not is_local(job)]
    core_h = sum(expected[job.benchmark] for job in larger) / 3600
    longest_s = max(expected[job.benchmark] for job in submitted)
    queued = expected | {job.benchmark: expected[job.benchmark] + WAIT_S for job in submitted}
    by_rule: dict[str, float] = defaultdict(float)
    for job in submitted:
        by_rule[job.rule] += expected[job.benchmark] / 3600
    most = sorted(by_rule.items(), key=lambda item: -item[1])[:5]
    results = len({path for job in larger for path in job.outputs})
    rows = [
        ["jobs, and of these in the queue", f"{len(larger)}, {len(submitted)}"],
        ["core time (h)", f"{core_h:.0f}"],
        ["of which " + ", ".join(f"`{rule}`" for rule, _ in most), ", ".join(f"{hours:.0f}" for _, hours in most)],
        ["longest job in the queue (min)", f"{longest_s / 60:.1f}"],
        *([f"wall time with {n} jobs at once (h)", f"{wall_time(larger, queued, n) / 3600:.1f}"] for n in SLOTS),
        ["results", results],
        ["plan (`snakemake -n`): core time (min), memory (GB)", f"{plan_s / 60:.1f}, {plan_mb / 1000:.1f}"],
    ]
    head = [f"{options.sources} datasets, {options.seeds} seeds, {options.explainers} explainers", ""]
    found = {
        "jobs": len(larger),
        "submitted": len(submitted),
        "core_h": round(core_h, 1),
        "longest_s": round(longest_s, 1),
        "results": results,
        "plan_s": round(plan_s, 1),
        "plan_mb": round(plan_mb),
    }
    return markdown.table(head, rows), found


def larger_config(sources: int, seeds: int, explainers: int) -> dict:
    """Return what a config changes of the default for so many of each; the default's own come first.

    Raises:
        InputError: fewer sources than the default has, or more explainers than there are.
    """
    import yaml

    from gpca.explainers.registry import explainers as known

    default = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    own = yaml.safe_load((ROOT / "config/sources.yaml").read_text(encoding="utf-8"))["sources"]
    others = [name for name in known() if name not in default["explainers"] and not name.startswith("learner_")]
    rows = [name for name, entry in default["explainers"].items() if entry is not False]
    most = len(rows) + len(others)
    for name, count, low, high in (
        ("sources", sources, len(own), 10_000),
        ("seeds", seeds, 1, 1000),
        ("explainers", explainers, 1, most),
    ):
        if not low <= count <= high:
            raise InputError(f"--{name} {count}", "cannot be planned", f"give {low} to {high}")
    further = {name: {} for name in others[: max(0, explainers - len(rows))]}
    copies = islice(cycle(own.values()), sources - len(own))
    return {
        "seeds": list(range(seeds)),
        "sources": {f"copy{n}": entry | {"title": f"Copy {n}"} for n, entry in enumerate(copies)},
        "explainers": further | dict.fromkeys(rows[explainers:], False),
        "controls": {"controls": [name for name in default["controls"]["controls"] if name != "transfer"]},
    }


def estimated(jobs: Sequence[Job], seconds: Mapping[str, float], larger: Sequence[Job]) -> dict[str, float]:
    """Return the seconds that each job of the larger run would take, by the rates of the measured one."""
    made = {path for each in (jobs, larger) for job in each for path in job.outputs}

    def files(job: Job) -> int:
        return sum(path in made for path in (*job.inputs, *job.outputs))

    rates, of_kind = defaultdict(list), defaultdict(list)
    for job in jobs:
        rate = seconds[job.benchmark] / files(job)
        rates[job.rule].append(rate)
        of_kind[is_local(job)].append(rate)
    return {job.benchmark: files(job) * fmean(rates.get(job.rule) or of_kind[is_local(job)]) for job in larger}


def is_local(job: Job) -> bool:
    """Return whether a cluster's queue does not see the job: those that collect and draw run beside Snakemake."""
    return job.rule in _local_rules() or job.benchmark.startswith(("benchmarks/tables/", "benchmarks/figures/"))


@cache
def _local_rules() -> set[str]:
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "workflow/rules").glob("*.smk"))
    blocks = re.split(r"^rule (\w+):$", text, flags=re.MULTILINE)[1:]
    local = {rule for rule, block in zip(blocks[::2], blocks[1::2], strict=True) if "localrule: True" in block}
    return local | {tidy.target for each in experiments() for tidy in each.tidy if tidy.collector}


if __name__ == "__main__":
    sys.exit(main())
