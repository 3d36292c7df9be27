import hashlib
import json
import platform
import shutil
import subprocess
from types import SimpleNamespace

import pytest

from gpca import __version__
from gpca.jobs import provenance
from gpca.jobs.provenance import record_provenance, sha256_of_settings
from gpca.process.processor import describe


def test_the_sidecar_says_where_a_result_comes_from(monkeypatch, tmp_path):
    # The sidecar of a block that took 20 ms and had one input.
    monkeypatch.setenv("GPCA_CONFIG_SHA256", '{"seeds": "c0ffee"}')
    source, outputs = tmp_path / "in.npz", [tmp_path / "out.npz", tmp_path / "out.csv"]
    source.write_bytes(b"data")
    clock = iter([100.0, 100.02])
    monkeypatch.setattr(provenance, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    with record_provenance(outputs, [source], {"points": 5, "options": {"k": 3}}, seed=4):
        assert not list(tmp_path.glob("*.json"))
    sidecars = [output.with_name(output.name + ".provenance.json").read_text() for output in outputs]
    assert sidecars[0] == sidecars[1]
    record = json.loads(sidecars[0])
    assert record["inputs_sha256"] == {str(tmp_path / "in.npz"): hashlib.sha256(b"data").hexdigest()}
    assert record["settings"] == {"points": 5, "options": {"k": 3}}
    assert record["settings_sha256"] == sha256_of_settings({"options": {"k": 3}, "points": 5})
    assert (record["seed"], record["config_sha256"]) == (4, {"seeds": "c0ffee"})
    lock = (provenance.ROOT / "environment.lock").read_bytes()
    assert record["environment_lock_sha256"] == hashlib.sha256(lock).hexdigest()
    assert record["python"] == platform.python_version()
    assert {"numpy", "torch", "open3d-cpu", "gpytorch"} <= set(record["libraries"])
    assert record["seconds"] == 0.02
    assert 10 < record["peak_memory_mb"] < 1e6
    assert "cores" in record["device"]["name"]
    assert set(record["device"]) == {*describe(), "gpu"}
    assert set(record["code"]) == {"version", "commit", "dirty"}
    assert record["code"]["version"] == __version__


def test_a_failed_block_leaves_no_sidecar(tmp_path):
    with pytest.raises(RuntimeError), record_provenance([tmp_path / "out.npz"], [], {}):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_the_code_version_tells_the_commit_and_whether_it_was_edited(monkeypatch, tmp_path):
    # Makes a package in a folder, and a commit there of all files that are given.
    if shutil.which("git") is None:
        pytest.skip("needs git")

    def git_at(package, repository, *kept):
        (package / "gpca").mkdir(parents=True)
        (package / "gpca/__init__.py").write_text("one = 1\n")
        identity = ["-c", "user.name=A", "-c", "user.email=a@b.org"]
        for command in (["init"], ["add", "--", *kept], [*identity, "commit", "--allow-empty", "-m", "first"]):
            subprocess.run(["git", "-C", repository, *command], check=True, capture_output=True)
        monkeypatch.setattr(provenance, "ROOT", package)

    git_at(tmp_path, tmp_path, "gpca")
    head = subprocess.run(["git", "-C", tmp_path, "rev-parse", "HEAD"], capture_output=True, text=True, check=True)
    assert provenance._code_version() == {"version": __version__, "commit": head.stdout.strip(), "dirty": False}
    (tmp_path / "result.csv").write_text("untracked files are no code\n")
    assert provenance._code_version()["dirty"] is False
    (tmp_path / "gpca/__init__.py").write_text("one = 2\n")
    assert provenance._code_version()["dirty"] is True


UNKNOWN = {"version": __version__, "commit": None, "dirty": None}


def test_without_a_checkout_git_or_a_lock_the_code_is_unknown(tmp_path, monkeypatch):
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    assert provenance._code_version() == UNKNOWN
    monkeypatch.setenv("PATH", str(tmp_path))
    assert provenance._code_version() == UNKNOWN
    monkeypatch.setattr(provenance, "ROOT", tmp_path)
    with record_provenance([tmp_path / "out.csv"], [], {}):
        pass
    record = json.loads((tmp_path / "out.csv.provenance.json").read_text())
    assert record["environment_lock_sha256"] is None
    assert record["code"] == UNKNOWN
