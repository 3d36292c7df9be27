"""Kill a smoke run again and again and see that the same command ends it with the bytes of one that was left alone.

    python benchmarks/kills.py [--kills 20] [--longest 30] [--seed 0] [--cores 2] [--folder build/kills]

Each start is the same command. `kill -9` ends its whole process group after seconds that are drawn from 0 to --longest
(by the seed; what the run is doing just then, chance decides); the last start runs to its end. A run that ends before
it is killed is compared, removed and begun anew, so that there are as many kills as asked for. Compared are the bytes
of all results but those that hold seconds, and what lies beside them. Works in a folder of its own, which is removed if
all is well. Status 1 if a start was refused, a byte differs or anything is left.
The last line is a JSON object: kills, runs, files, differing, left.
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MEASURED = ("timings", "timings.csv", "benchmarks", "logs", "page", "index.html", "ro-crate-metadata.json")
DRAWN_FROM_IT = (  # and show seconds
    *("runtime", "table1_extended", "table7_runtime", "table8_recovery"),
    *("table11_registration", "table12_failures", "table17_scans", "claims", "comparison"),
)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20, help="default 20")
    parser.add_argument("--longest", type=float, default=30.0, help="most seconds before a kill, default 30")
    parser.add_argument("--seed", type=int, default=0, help="seed of the times of the kills, default 0")
    parser.add_argument("--cores", type=int, default=2, help="default 2")
    parser.add_argument(
        "--folder", type=Path, default=ROOT / "build/kills", help="default build/kills, which is recreated"
    )
    options = parser.parse_args(arguments)
    shutil.rmtree(options.folder, ignore_errors=True)
    undisturbed, disturbed = (options.folder / name for name in ("undisturbed", "killed"))
    command = [sys.executable, "-m", "snakemake", f"-j{options.cores}", "all", "--configfile", "config/smoke.yaml"]
    print("undisturbed", flush=True)
    start(command, undisturbed, None)
    expected = results(undisturbed / "results/smoke")
    delays = random.Random(options.seed)
    kills, runs, differing, left = 0, 0, set[str](), set[str]()
    while True:
        delay_s = delays.uniform(0, options.longest) if kills < options.kills else None
        if not start(command, disturbed, delay_s):
            kills += 1
            print(f"kill {kills} after {delay_s:.1f} s", flush=True)
            continue
        runs += 1
        actual = results(disturbed / "results/smoke")
        differing |= {name for name in expected.keys() | actual.keys() if expected.get(name) != actual.get(name)}
        left |= unfinished(disturbed)
        print(f"run {runs} has ended; differing: {sorted(differing)}; left: {sorted(left)}", flush=True)
        if delay_s is None:
            break
        shutil.rmtree(disturbed)
    found = {"kills": kills, "runs": runs, "files": len(expected), "differing": len(differing), "left": len(left)}
    if not differing and not left:
        shutil.rmtree(options.folder)
    print(json.dumps(found))
    return int(bool(differing or left))


def start(command: list[str], folder: Path, delay_s: float | None) -> bool:
    """Run Snakemake in `folder`, kill its process group after the delay, and return whether it ended before.

    It ends this process where Snakemake fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("GPCA_", "SNAKEMAKE"))}
    with (folder / "snakemake.log").open("wb") as log:
        process = subprocess.Popen(
            [*command, "--directory", str(folder)],
            cwd=ROOT, env=environment, start_new_session=True, stdout=log, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            status = process.wait(delay_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            return False
    if status:
        print((folder / "snakemake.log").read_text(encoding="utf-8")[-4000:], file=sys.stderr)
        sys.exit(f"kills: the command failed with status {status}; its folder is {folder}")
    return True


def results(folder: Path) -> dict[str, bytes]:
    """Paths and bytes of all results of a run but those that hold seconds and memory, or are drawn from such."""
    files = {path.relative_to(folder): path for path in folder.rglob("*") if path.is_file()}
    return {
        str(name): path.read_bytes()
        for name, path in sorted(files.items())
        if name.parts[0] not in MEASURED
        and name.name.split(".")[0] not in DRAWN_FROM_IT
        and not name.name.endswith(".provenance.json")
    }


def unfinished(folder: Path) -> set[str]:
    """What a killed job leaves beside results, a killed Snakemake in its folder, until the next start clears it."""
    halves = {path for path in folder.glob("results/**/*") if ".partial" in path.name or path.suffix == ".checkpoint"}
    state = {
        path for name in ("locks", "scripts", "incomplete", "shadow") for path in folder.glob(f".snakemake/{name}/*")
    }
    return {str(path) for path in halves | state}


if __name__ == "__main__":
    sys.exit(main())
