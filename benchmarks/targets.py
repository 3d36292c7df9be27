"""What each table and figure of a finished run takes: jobs, core time, wall time, memory.

    python benchmarks/targets.py results/full [--configfile config/full.yaml] [--config data_dir=/data] [--cores 2]
    python benchmarks/targets.py results/full --write docs/appendix.md

Snakemake's plan of the whole run (a dry run, nothing is made) says which jobs a target needs; the run's benchmark files
say how long each took and how much memory it held. Core time is the sum over those jobs. Wall time is that of a
schedule which starts the next job as soon as a core is free, the higher priority first: without Snakemake's own start,
some ten seconds. A job that was killed and continued counts with its last part alone. --write puts the rows of the
tables, the model, `paper` and `all` between the two comments that the page has for the run; all rows are printed. The
last line is a JSON object of the target `all`.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from benchmarks import markdown  # noqa: E402 (the script runs from a plain checkout)
from benchmarks.pipeline import number  # noqa: E402
from benchmarks.schedule import Job, wall_time  # noqa: E402
from gpca.errors import InputError  # noqa: E402

TARGETS = re.compile(r"(tables/\w+\.md|figures/\w+\.png|[\w.]+)$")  # and what lies in the run's folder itself
# A figure takes about what the table of the same results takes, and so does another form of a table.
ON_PAGE = re.compile(
    r"tables/(?!\w+_(?:compact|grid|oracle|seen_unseen|severity|shift|stream)\.md)|(?:model\.pt|paper|all)$"
)


@dataclass(frozen=True)
class Cost:
    """What a target takes: number of jobs, seconds on one core and on several, memory of its largest job in MB."""

    jobs: int
    core_s: float
    wall_s: float
    peak_mb: float


def main(arguments: list[str] | None = None) -> int:
    parser = parser_of_run(__doc__)
    parser.add_argument("--cores", type=int, default=2, help="cores for the wall time, default 2")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="Markdown page with a place for the rows")
    options = parser.parse_args(arguments)
    try:
        run, configured = name_of_run(options.folder), (options.configfile, options.config)
        named = {target: read_plan(plan(run, *configured, target), run) for target in ("paper", "all")}
        needed_by = targets(named["all"]) | named
        costs = {target: cost(needed, options.folder, options.cores) for target, needed in needed_by.items()}
        if options.write:
            shown = {target: of_target for target, of_target in costs.items() if ON_PAGE.match(target)}
            markdown.write_between(options.write, f"results/{run}", table(shown, options.cores))
    except InputError as fault:
        print(f"targets: {fault}", file=sys.stderr)
        return 2
    print("\n".join(table(costs, options.cores)))
    print(json.dumps(vars(costs["all"]) if costs["all"] else {}))
    return 0


def parser_of_run(description: str | None) -> argparse.ArgumentParser:
    """Return a parser of the folder of a finished run and of what that was configured by."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of a finished run, such as results/full")
    parser.add_argument("--configfile", type=Path, help="config of that run; default config/{run}.yaml, if it exists")
    parser.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE", help="as for snakemake")
    return parser


def name_of_run(folder: Path) -> str:
    """Return the name of the run in a folder.

    Raises:
        InputError: no job was measured there.
    """
    if not (folder / "benchmarks").is_dir():
        raise InputError(folder, "has no benchmark files", "name the folder of a finished run")
    return folder.resolve().name


def plan(run: str, configfile: Path | None, config: list[str], target: str = "all") -> str:
    """Return what Snakemake prints of a dry run of a target and all that it needs, done or not."""
    named = ROOT / f"config/{run}.yaml"
    configfile = configfile or (named if named.is_file() else None)
    command = [sys.executable, "-m", "snakemake", "--dry-run", "--forceall", "--nolock", target]
    command += ["--config", *config, f"run={run}", *(["--configfile", str(configfile)] if configfile else [])]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("SNAKEMAKE")}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        line = done.stderr.strip().splitlines()[-1]
        raise InputError(f"the plan of run '{run}'", f"cannot be made: {line}", "give --configfile and --config")
    return done.stdout


def read_plan(text: str, run: str) -> list[Job]:
    """Return the jobs that leave a benchmark file; paths below the run's folder are relative to it."""
    jobs, prefix = [], f"results/{run}/"
    blocks = re.split(r"^(?:local)?rule (\w+):$", text, flags=re.MULTILINE)[1:]
    for rule, block in zip(blocks[::2], blocks[1::2], strict=True):
        given = dict(re.findall(r"^    (input|output|benchmark|priority|threads): (.*)$", block, flags=re.MULTILINE))
        if "benchmark" in given:
            inputs, outputs = (
                tuple(path.removeprefix(prefix) for path in given.get(name, "").split(", "))
                for name in ("input", "output")
            )
            scheduled = (int(given.get(name, default)) for name, default in (("priority", 0), ("threads", 1)))
            jobs.append(Job(inputs, outputs, given["benchmark"].removeprefix(prefix), *scheduled, rule))
    return jobs


def targets(jobs: list[Job]) -> dict[str, list[Job]]:
    """Return the jobs that each target needs, by its path."""
    maker = {path: job for job in jobs for path in job.outputs}

    def needed(target: str) -> list[Job]:
        found: dict[str, Job] = {}
        open_paths = [target]
        while open_paths:
            job = maker.get(open_paths.pop())
            if job and job.benchmark not in found:
                found[job.benchmark] = job
                open_paths += job.inputs
        return list(found.values())

    shown = sorted(path for path in maker if TARGETS.match(path))
    return {path: needed(path) for path in shown}


def cost(jobs: list[Job], folder: Path, cores: int) -> Cost | None:
    """Return what the jobs took, by their benchmark files; None where one of them has none."""
    records = {job.benchmark: folder / job.benchmark for job in jobs}
    if not all(path.is_file() for path in records.values()):
        return None
    seconds = {name: sum(number(path, "s")) for name, path in records.items()}
    peak_mb = max((mb for path in records.values() for mb in number(path, "max_rss")), default=0.0)
    core_s = sum(seconds[job.benchmark] * job.threads for job in jobs)
    return Cost(len(jobs), core_s, wall_time(jobs, seconds, cores), peak_mb)


def table(costs: Mapping[str, Cost | None], cores: int) -> list[str]:
    """Return the Markdown table, a row per target."""
    rows = []
    for target, of_target in costs.items():
        cells = ["not measured", "", "", ""]
        if of_target:
            minutes = (f"{value_s / 60:.1f}" for value_s in (of_target.core_s, of_target.wall_s))
            cells = [str(of_target.jobs), *minutes, f"{of_target.peak_mb:.0f}"]
        rows.append([f"`{target}`", *cells])
    head = ["target", "jobs", "core time (min)", f"wall time on {cores} cores (min)", "largest job (MB)"]
    return markdown.table(head, rows)


if __name__ == "__main__":
    sys.exit(main())
