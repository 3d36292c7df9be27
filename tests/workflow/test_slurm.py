"""The smoke run through the profile of SLURM, with a cluster of one node on this machine: a part of it, and the whole.

Both need Debian's packages slurm-wlm and munge, root, and the executor plugin; without one of them they are skipped.
The whole run has to be asked for as well: `GPCA_WHOLE_SLURM=1 make test PYTEST_ARGS=tests/workflow/test_slurm.py`.
"""

import os
import re
import shutil
import socket
import subprocess
import time
from collections import Counter

import pytest

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue", "sinfo")
FOLDERS = os.pathsep.join((os.environ["PATH"], "/usr/sbin", "/sbin"))
MISSING = [name for name in PROGRAMS if shutil.which(name, path=FOLDERS) is None]
CONFIG = """
ClusterName=tests
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={node}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
MinJobAge=86400
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName={host} NodeAddr=127.0.0.1 CPUs=4 RealMemory=16000
PartitionName=tests Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""

pytestmark = [
    pytest.mark.skipif(bool(MISSING), reason=f"no {', '.join(MISSING)}: install slurm-wlm and munge"),
    pytest.mark.skipif(os.geteuid() != 0, reason="the daemons of SLURM are started by root alone"),
]


def free_port():
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        return listening.getsockname()[1]


@pytest.fixture
def cluster(tmp_path_factory, monkeypatch):
    """A controller and a node of four cores, which every command of SLURM finds by its configuration."""
    pytest.importorskip("snakemake_executor_plugin_slurm")
    folder = tmp_path_factory.mktemp("slurm")
    host = socket.gethostname().split(".")[0]
    config = folder / "slurm.conf"
    config.write_text(CONFIG.format(host=host, folder=folder, controller=free_port(), node=free_port()))
    (folder / "munge.key").write_bytes(os.urandom(128))
    (folder / "munge.key").chmod(0o600)
    for name in ("state", "spool"):
        (folder / name).mkdir()
    # Within a job Snakemake takes away every variable of SLURM's, the place of the configuration among them.
    (folder / "bin").mkdir()
    (folder / "bin/srun").write_text(f'#!/bin/sh\nSLURM_CONF={config} exec {shutil.which("srun")} "$@"\n')
    (folder / "bin/srun").chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join((str(folder / "bin"), FOLDERS)))
    monkeypatch.setenv("SLURM_CONF", str(config))
    files = {"key-file": "key", "socket": "socket", "pid-file": "pid", "log-file": "log", "seed-file": "seed"}
    munge = [f"--{option}={folder}/munge.{name}" for option, name in files.items()]
    started = []

    def start(*command):
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        started.append(subprocess.Popen(command, start_new_session=True, **quiet))

    try:
        start("munged", "--foreground", "--force", *munge)
        wait_until((folder / "munge.socket").exists, folder)
        start("slurmctld", "-D")
        start("slurmd", "-D", "-N", host)
        wait_until(lambda: "idle" in said("sinfo", "--noheader", "--format=%T"), folder)
        yield folder
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait(30)


def wait_until(happened, folder):
    for _ in range(300):
        if happened():
            return
        time.sleep(0.1)
    pytest.fail("\n".join(path.read_text()[-2000:] for path in sorted(folder.glob("*.log"))))


def said(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout


# This cluster keeps no accounts, so the states come from the queue; and its jobs take seconds.
HERE = (
    *("--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "2"),
    *("--latency-wait", "5", "--seconds-between-status-checks", "2"),
)


def submit(project, *targets):
    """Run the targets of the smoke run through the queue; return the names of the jobs that it completed."""
    project.snakemake(*targets, "--profile", "workflow/profiles/slurm", "--configfile", "config/smoke.yaml", *HERE)
    jobs = [line.split("|") for line in said("squeue", "--states=all", "--noheader", "--format=%k|%T").splitlines()]
    assert {state for _, state in jobs} == {"COMPLETED"}
    return [name for name, _ in jobs]


def test_the_queue_sees_compute_alone_and_groups_of_jobs_as_one(cluster, project):
    wanted = ["figures/objects_ycb.png", *(f"predictions/ycb/{name}/seed0.csv" for name in ("gpca", "gpca_paper"))]
    jobs = submit(project, *(f"results/smoke/{name}" for name in wanted))
    assert [name for name in wanted if not (project.folder / f"results/smoke/{name}").is_file()] == []
    # A training with its embedding is one job of the queue, as are the explainers (of two seeds); the figure is none.
    names = ("sample_objects", "register", "encoder", "attribute")
    expected = {"sample_objects": 1, "register": 2, "encoder": 2, "attribute": 1}
    assert Counter(re.match(f"rule_({'|'.join(names)})", name)[1] for name in jobs) == expected
