import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gpca.__main__ import COMMANDS
from gpca.errors import InputError
from gpca.jobs.job import Job, as_process
from gpca.process.code_files import ROOT

JOB = Job(
    source="ycb",
    seeds=[0, 1],
    registrations=[Path("a"), Path("b")],
    poses=[],
    settings={"icp": None, "gpc": {"inducing": 6}},
)
SNAKEMAKE = """
import sys
from types import SimpleNamespace
from gpca.jobs.job import run_step
run_step(SimpleNamespace(
    threads=2, log=["log.txt"], wildcards={"seed": "7", "source": "tiny"},
    params={"step": "own_step", "settings": '{"b": 1, "a": 2}', "folders": {"data_dir": "data"}, "threads": 1},
    input={"code": ["x.py"], "one": "in.csv", "some": ["a", "b"]}, output={"out": "out.json"},
))
"""
STEP = """
import json, os, sys
from gpca.errors import InputError
def run(job):
    print("working", file=sys.stderr)
    if job.seed != 7:
        raise InputError("seed", "is another", "give 7")
    names = {name: value for name, value in vars(job).items()}
    job.out.write_text(json.dumps(names | {"omp": os.environ["OMP_NUM_THREADS"]}, default=str))
"""


def test_what_a_rule_gives_is_an_attribute_and_what_it_lacks_is_named():
    assert JOB.source == "ycb"
    assert JOB.get("poses") is None
    assert JOB.get("start", "none") == "none"
    assert JOB.files("registrations") == [Path("a"), Path("b")]
    assert JOB.section("icp") == JOB.section("encoder") == {}
    assert JOB.by_name("gpc", ["inducing", "draws"]) == {"inducing": 6, "draws": {}}
    assert list(JOB.per_seed("registrations")) == [(0, Path("a")), (1, Path("b"))]
    with pytest.raises(ValueError, match="shorter"):
        list(JOB.per_seed("poses"))
    with pytest.raises(AttributeError, match="gives no 'encoder'"):
        JOB.encoder  # noqa: B018


@pytest.mark.parametrize(
    ("fault", "status", "line"),
    [
        (InputError("a.csv", "is empty", "fill it"), 2, "step: a.csv: is empty; fill it\n"),
        (
            ModuleNotFoundError("No module named 'shap.plots'", name="shap.plots"),
            2,
            "step: shap: this Python package is not installed; "
            "install it, 'pip install \".[suite]\"' in the folder of the suite\n",
        ),
        (FileNotFoundError(2, "No such file", "a.csv"), 2, "step: [Errno 2] No such file: 'a.csv'\n"),
        (MemoryError(), 2, "step: this machine ran out of memory; use smaller settings or another machine\n"),
        (KeyboardInterrupt(), 130, "step: stopped; repeat the command to continue\n"),
    ],
)
def test_a_fault_ends_in_one_line_and_a_status(capsys, fault, status, line):
    def step():
        raise fault

    assert as_process("step", step) == status
    assert capsys.readouterr().err == line


@pytest.mark.parametrize("seed", ["7", "8"])
def test_a_script_of_the_workflow_runs_a_step_with_what_its_rule_gives(tmp_path, seed):
    (tmp_path / "own_step.py").write_text(STEP)
    code = SNAKEMAKE.replace('"7"', f'"{seed}"')
    environment = {"PYTHONPATH": f"{ROOT}:{tmp_path}", "PATH": ""}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    log = (tmp_path / "log.txt").read_text()
    assert (done.stdout, done.stderr) == ("", "")
    if seed == "8":
        assert done.returncode == 2
        assert log == "working\nown_step: seed: is another; give 7\n"
        return
    assert done.returncode == 0
    given = json.loads((tmp_path / "out.json").read_text())
    assert given == {
        "source": "tiny", "seed": 7, "settings": {"b": 1, "a": 2}, "threads": 1, "omp": "1", "one": "in.csv",
        "some": ["a", "b"],
        "out": "out.json", "data_dir": "data", "downloads": ".",
    }  # fmt: skip


SCRIPT = """
import sys
from snakemake.iocontainers import InputFiles, Log, OutputFiles, Params
from types import SimpleNamespace
from gpca.errors import InputError
from gpca.jobs.job import workflow_script
snakemake = SimpleNamespace(
    input=InputFiles(fromdict={"predictions": ["predictions.csv"], "code": ["module.py"]}),
    output=OutputFiles(toclone=["table.md"]),
    params=Params(fromdict={"title": "A title"}),
    log=Log(toclone=["log.txt"]),
)
with workflow_script(snakemake):
    print("working", file=sys.stderr)
"""


def run_script(folder, body):
    (folder / "predictions.csv").write_text("sample\n")
    (folder / "module.py").write_text("")
    environment = {"PYTHONPATH": str(ROOT), "PATH": os.environ["PATH"]}
    command = [sys.executable, "-c", f"{SCRIPT}    {body}\n"]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("", "")
    return done.returncode, (folder / "log.txt").read_text()


def test_a_script_ends_with_one_line_of_its_fault_or_the_provenance_of_data_and_parameters(tmp_path):
    status, log = run_script(tmp_path, 'raise InputError("metrics.csv", "is empty", "regenerate it")')
    assert (status, log) == (2, "working\nmetrics.csv: is empty; regenerate it\n")
    assert not list(tmp_path.glob("*.provenance.json"))
    assert run_script(tmp_path, 'open("table.md", "w").write("a table")') == (0, "working\n")
    record = json.loads((tmp_path / "table.md.provenance.json").read_text())
    assert list(record["inputs_sha256"]) == ["predictions.csv"]
    assert record["settings"] == {"title": "A title"}


ASCII = {"PYTHONIOENCODING": "ascii"}
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
HELP = [sys.executable, "-m", "gpca", "--help"]
MUCH = "from gpca.jobs.job import as_process; raise SystemExit(as_process('gpca', lambda: print('word ' * 100_000)))"
PRINTING = [sys.executable, "-c", MUCH]


def gpca(arguments, redirection="", **variables):
    """Run a command with its streams as a shell would have them."""
    command = ["bash", "-c", f'"$@" {redirection}', "bash", *map(str, arguments)]
    return subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": ""} | variables,
        capture_output=True,
    )


def test_every_help_can_be_printed_in_ascii():
    code = (
        "import sys; from gpca.__main__ import main, COMMANDS\n"
        "for command in COMMANDS:\n"
        "    try: main([command, '--help'])\n"
        "    except SystemExit as end: assert end.code == 0\n"
    )
    done = gpca([sys.executable, "-c", code], **ASCII, **C_LOCALE)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.isascii()
    assert done.stdout.count(b"usage:") == len(COMMANDS)
    assert rb"\xd7" in done.stdout  # 4×4


@pytest.mark.parametrize("environment", [ASCII, C_LOCALE])
def test_an_explanation_can_be_printed_in_ascii(tmp_path, model, environment):
    import trimesh

    model.save(tmp_path / "model.pt")
    mesh = tmp_path / "tasse_ä.ply"
    trimesh.creation.box((0.04, 0.07, 0.10)).export(mesh)
    command = [sys.executable, "-m", "gpca", "explain", mesh, mesh, "--uncertainty", "--model", tmp_path / "model.pt"]
    done = gpca(command, **environment)
    assert done.returncode == 0, done.stderr
    assert done.stdout.isascii()
    assert rb"\xb0 and " in done.stdout  # the spread in °
    assert b"Traceback" not in done.stderr


def test_a_fault_can_be_printed_in_ascii():
    done = gpca([sys.executable, "-m", "gpca", "check-config", "tasse_ä.yaml"], **C_LOCALE)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert b"no such file" in done.stderr


@pytest.mark.parametrize(
    ("command", "redirection", "said"),
    [
        (HELP, "> /dev/full", "cannot be written (No space left on device)"),
        (HELP, "| (exec <&-; sleep 0); exit ${PIPESTATUS[0]}", "cannot be written (Broken pipe)"),
        (PRINTING, "| (exec <&-; sleep 0); exit ${PIPESTATUS[0]}", "cannot be written (Broken pipe)"),
        ([*HELP[:-1], "check-config"], ">&-", "is closed; redirect it"),
    ],
)
def test_what_cannot_be_printed_is_one_line_and_status_2(command, redirection, said):
    done = gpca(command, redirection)
    assert done.returncode == 2
    lines = done.stderr.decode().splitlines()
    assert len(lines) == 1, lines
    assert f"stdout: {said}" in lines[0]


def test_where_stderr_is_gone_the_status_remains_and_stdout_stays_clean():
    done = gpca([sys.executable, "-m", "gpca", "check-config", "missing.yaml"], "2>&-")
    assert (done.returncode, done.stdout) == (2, b"")
