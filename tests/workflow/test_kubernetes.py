"""The profile of Kubernetes, with a `kubectl` that keeps what it is told and runs each Job at once on this machine."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest
import yaml

from .conftest import ROOT

PROFILE = ROOT / "workflow/profiles/kubernetes"
KUBECTL = """#!{python}
import json, subprocess, sys
from pathlib import Path
import yaml

folder, (command, *words) = Path({folder!r}), sys.argv[1:]
if command == "create":
    job = yaml.safe_load(sys.stdin)
    name = f"gpca-{{len(list(folder.glob('*.json')))}}"
    [container] = job["spec"]["template"]["spec"]["containers"]
    done = subprocess.run(container["command"], cwd=container["workingDir"], capture_output=True)
    job["ended"] = "Failed" if done.returncode else "Complete"
    (folder / f"{{name}}.json").write_text(json.dumps(job))
    print(f"job.batch/{{name}}")
if command == "get":
    path = folder / (words[0].removeprefix("job.batch/") + ".json")
    if path.is_file():
        print(path.stem, json.loads(path.read_text())["ended"])
if command == "delete":
    for word in words:
        (folder / (word.removeprefix("job.batch/") + ".json")).unlink(missing_ok=True)
"""


@pytest.fixture
def cluster(tmp_path_factory, monkeypatch):
    """The folder in which `kubectl` keeps the Jobs."""
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "kubectl").write_text(KUBECTL.format(python=sys.executable, folder=str(folder)))
    (folder / "kubectl").chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join((str(folder), os.environ["PATH"])))
    return folder


def said(command, folder=ROOT):
    return subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=True).stdout.strip()


def submitted(script, folder):
    """What the profile's command prints of a job with two threads, 3 GB and 90 minutes, as Snakemake calls it."""
    command = yaml.safe_load((PROFILE / "config.yaml").read_text())["cluster-generic-submit-cmd"]
    filled = command.format(threads=2, resources=SimpleNamespace(mem_mb=3000, runtime=90))
    (folder / "job.sh").write_text(script)
    return said(f'{filled.replace("workflow/", f"{ROOT}/workflow/")} "{folder}/job.sh"', folder)


def test_a_job_asks_for_what_its_rule_declares_and_runs_where_the_project_is(cluster, tmp_path):
    name = submitted("pwd > here\n", tmp_path)
    assert name == "job.batch/gpca-0"
    assert (tmp_path / "here").read_text() == f"{tmp_path}\n"
    job = yaml.safe_load((cluster / "gpca-0.json").read_text())
    pod = job["spec"]["template"]["spec"]
    [container] = pod["containers"]
    assert container["resources"]["requests"] == {"cpu": "2", "memory": "3000M"}
    assert (pod["activeDeadlineSeconds"], pod["restartPolicy"], job["spec"]["backoffLimit"]) == (5400, "Never", 0)
    assert container["image"] == "gpca-bench"
    [mount], [volume] = container["volumeMounts"], pod["volumes"]
    assert mount == {"name": volume["name"], "mountPath": "/gpca"}
    assert volume["persistentVolumeClaim"] == {"claimName": "gpca-bench"}


def test_the_state_of_a_job_is_told_also_once_it_is_gone(cluster, tmp_path, monkeypatch):
    good, bad = submitted("exit 0\n", tmp_path), submitted("exit 1\n", tmp_path)
    assert said(f"{PROFILE}/status {good}") == "success"
    assert said(f"{PROFILE}/status {bad}") == "failed"
    said(f"{PROFILE}/cancel {good} {bad}")
    assert said(f"{PROFILE}/status {good}") == "failed"
    assert not list(cluster.glob("*.json"))
    (cluster / "kubectl").write_text("#!/bin/sh\nexit 1\n")  # the cluster does not answer
    assert said(f"{PROFILE}/status {good}") == "running"


def test_snakemake_submits_its_jobs_through_the_profile(cluster, project):
    pytest.importorskip("snakemake_executor_plugin_cluster_generic")
    target = "results/smoke/objects/ycb.npz"
    options = ("--profile", PROFILE.relative_to(ROOT), "--configfile", "config/smoke.yaml", "--latency-wait", "5")
    project.snakemake_as_processes(target, *options)
    assert (project.folder / target).is_file()
    [job] = [yaml.safe_load(path.read_text()) for path in cluster.glob("*.json")]
    [container] = job["spec"]["template"]["spec"]["containers"]
    assert container["workingDir"] == str(project.folder)
    assert container["resources"]["requests"] == {"cpu": "1", "memory": "3000M"}
