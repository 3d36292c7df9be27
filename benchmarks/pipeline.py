"""Where the time of a run goes, stage by stage, and how much of it is the workflow's own.

    python benchmarks/pipeline.py [--configfile config/smoke.yaml] [--cores 2] [--config data_dir=/data]
    python benchmarks/pipeline.py --existing full

The first form makes everything afresh as the run `benchmark` (results/benchmark is removed first) and takes the wall
time with a clock; without --configfile it is the default run. The second only reads the files of a run that is
there. Two records are read: the provenance sidecars (seconds of work inside a step, peak memory) and Snakemake's
benchmark files (seconds of the whole job). From cores × wall time, the core time, follow

    share of a stage = its work / core time,    overhead share = 1 - all work / core time ,

the latter being process starts, imports, Snakemake itself and idle cores. Jobs use one thread each. What a step
imports only when it needs it counts as work. The last line is a JSON object: stages, overhead_share, peak_mb.
"""

import argparse
import csv
import json
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from gpca.errors import InputError  # noqa: E402

RUN = "benchmark"
STAGES = (
    "objects",
    "scenes",
    "instances",
    "registrations",
    "methods",
    "causes",
    "descriptors",
    "cause_encoders",
    "cause_embeddings",
    "diagnoses",
    "estimates",
    "encoders",
    "embeddings",
    "uncertainty",
    "predictions",
    "control_embeddings",
    "controls",
    "active_learning",
    "kernels",
    "shifted",
    "learners",
    "recovery",
    "collect",
    "tables",
    "figures",
)
SIDECAR = ".provenance.json"


@dataclass
class Stage:
    """The jobs of one stage.

    Attributes:
        work_s: of every recorded block of work, its seconds.
        job_s: of every job with a benchmark file, its seconds.
        peaks_mb: resident memory, of every record that has it.
    """

    work_s: list[float] = field(default_factory=list)
    job_s: list[float] = field(default_factory=list)
    peaks_mb: list[float] = field(default_factory=list)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--configfile", type=Path, help="as for snakemake")
    parser.add_argument("--config", nargs="+", default=[], metavar="KEY=VALUE", help="as for snakemake")
    parser.add_argument("--cores", type=int, default=2, help="default 2")
    parser.add_argument("--existing", metavar="RUN", help="run nothing, only read results/RUN")
    options = parser.parse_args(arguments)
    folder = ROOT / "results" / (options.existing or RUN)
    try:
        wall_s = None if options.existing else run_workflow(folder, options.configfile, options.config, options.cores)
        stages = read_stages(folder)
        if wall_s is None:
            wall_s = wall_time(folder)
            print("Wall time is taken from the times of the files: pauses count, Snakemake's own start does not.")
    except InputError as fault:
        print(f"pipeline: {fault}", file=sys.stderr)
        return 2
    result = summary(stages, options.cores * wall_s)
    print_table(stages, result, options.cores, wall_s)
    print(json.dumps(result))
    return 0


def run_workflow(folder: Path, configfile: Path | None, config: list[str], cores: int) -> float:
    """Make everything of the run `benchmark` and return the wall seconds that it took."""
    shutil.rmtree(folder, ignore_errors=True)
    command = [sys.executable, "-m", "snakemake", f"-j{cores}", "all", "--config", *config, f"run={RUN}"]
    if configfile is not None:
        command += ["--configfile", str(configfile)]
    started = perf_counter()
    if subprocess.run(command, cwd=ROOT, check=False).returncode:
        raise InputError(" ".join(["python", *command[1:]]), "failed", "see Snakemake's messages above")
    return perf_counter() - started


def read_stages(folder: Path) -> dict[str, Stage]:
    """Read the records below a run's folder; a stage is the first folder on the way, `collect` for files beside.

    Raises:
        InputError: no such folder, no record in it, or a damaged one.
    """
    if not folder.is_dir():
        raise InputError(folder, "no such run", "name one of the folders in results/")
    stages: dict[str, Stage] = {}
    # A step that writes several files in one block leaves the same record beside each (predictions and timings, a
    # table's formats): its work counts once, for the stage that comes first.
    distinct: dict[bytes, Path] = {}
    for path in sorted(
        folder.rglob(f"*{SIDECAR}"), key=lambda path: (_place(_stage_name(path.relative_to(folder))), path)
    ):
        distinct.setdefault(path.read_bytes(), path)
    for path in distinct.values():
        stage = stages.setdefault(_stage_name(path.relative_to(folder)), Stage())
        stage.work_s += number(path, "seconds")
        stage.peaks_mb += number(path, "peak_memory_mb")
    for path in sorted((folder / "benchmarks").rglob("*.tsv")):
        stage = stages.setdefault(_stage_name(path.relative_to(folder / "benchmarks")), Stage())
        stage.job_s += number(path, "s")
        stage.peaks_mb += number(path, "max_rss")
    if not any(stage.work_s for stage in stages.values()):
        raise InputError(folder, f"has no *{SIDECAR}", "make the run with this version of the workflow")
    return dict(sorted(stages.items(), key=lambda item: _place(item[0])))


def wall_time(folder: Path) -> float:
    """Return the seconds from the start of the first recorded job of a run to its last file."""
    files = (folder / "benchmarks").rglob("*.tsv")
    starts = [path.stat().st_mtime - seconds for path in files for seconds in number(path, "s")]
    if not starts:
        raise InputError(folder, "has no benchmark files", "make the run with this version of the workflow")
    return max(path.stat().st_mtime for path in folder.rglob("*") if path.is_file()) - min(starts)


def summary(stages: dict[str, Stage], core_s: float) -> dict:
    """Return the numbers of the last line: per stage, the overhead's share of the core time, the largest peak."""
    numbers = {
        name: {
            "jobs": len(stage.job_s) or len(stage.work_s),
            "work_s": round(sum(stage.work_s), 3),
            "job_s": round(sum(stage.job_s), 3),
            "peak_mb": max(stage.peaks_mb, default=0.0),
            "share": round(sum(stage.work_s) / core_s, 4),
        }
        for name, stage in stages.items()
    }
    work_s = sum(sum(stage.work_s) for stage in stages.values())
    peak_mb = max(stage["peak_mb"] for stage in numbers.values())
    return {"stages": numbers, "overhead_share": round(1 - work_s / core_s, 4), "peak_mb": peak_mb}


def print_table(stages: dict[str, Stage], result: dict, cores: int, wall_s: float) -> None:
    core_s = cores * wall_s
    print(f"\n{cores} cores × {wall_s:.1f} s wall time = {core_s:.1f} s of core time\n")
    _print_row("stage", "jobs", "work s", "job s", "peak MB", "share")
    for name, of_stage in result["stages"].items():
        job_s = f"{of_stage['job_s']:.1f}" if of_stage["job_s"] else "-"
        work_s, peak_mb = f"{of_stage['work_s']:.1f}", f"{of_stage['peak_mb']:.0f}"
        _print_row(name, of_stage["jobs"], work_s, job_s, peak_mb, f"{of_stage['share']:.1%}")
    # Where a stage has no benchmark files, its start-up is not told from waiting.
    measured = [stage for stage in stages.values() if stage.job_s]
    starting_s = sum(sum(stage.job_s) - sum(stage.work_s) for stage in measured)
    waiting_s = result["overhead_share"] * core_s - starting_s
    _print_row("starts, imports", "", f"{starting_s:.1f}", "", "", f"{starting_s / core_s:.1%}")
    _print_row("waiting, other", "", f"{waiting_s:.1f}", "", "", f"{waiting_s / core_s:.1%}")
    _print_row("overhead", "", "", "", f"{result['peak_mb']:.0f}", f"{result['overhead_share']:.1%}")


def _print_row(name: str, *cells: object) -> None:
    print(f"{name:16}" + "".join(f"{cell:>10}" for cell in cells))


def _stage_name(path: Path) -> str:
    return path.parts[0] if len(path.parts) > 1 else "collect"


def _place(stage: str) -> int:
    """Return the place of a stage in the order of the work; unknown ones come last."""
    return STAGES.index(stage) if stage in STAGES else len(STAGES)


def number(path: Path, key: str) -> list[float]:
    """Return the record's number in a list; an empty one where psutil found none (a very short job)."""
    text = path.read_text(encoding="utf-8")
    try:
        rows = csv.DictReader(text.splitlines(), delimiter="\t")
        value = (json.loads(text) if path.suffix == ".json" else next(rows))[key]
        return [] if value in ("NA", "-") else [float(value)]
    except (ValueError, KeyError, TypeError, StopIteration) as fault:
        raise InputError(path, f"has no number '{key}'", "repeat the run") from fault


if __name__ == "__main__":
    sys.exit(main())
