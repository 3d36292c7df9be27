"""A run on two cores, undisturbed, against one of a single source on one core that was killed and continued."""

import hashlib
import json

import pytest

from benchmarks.kills import unfinished
from gpca.declarations.registry import experiments, registered

from .conftest import is_interrupted

KEYS = {
    "seconds", "peak_memory_mb", "seed", "settings", "settings_sha256", "config_sha256", "inputs_sha256", "code",
    "environment_lock_sha256", "device", "python", "libraries",
}  # fmt: skip


@pytest.mark.parametrize(("suffix", "files"), {".npz": 15, ".pt": 2, ".csv": 14}.items())
def test_cores_and_interruptions_change_no_byte(smoke, killed_and_continued, suffix, files):
    # Besides its own results the source needs registrations of another one.
    runs = (smoke.results(suffix), killed_and_continued.project.results(suffix))
    expected, actual = ({name: content for name, content in run.items() if is_interrupted(name)} for run in runs)
    assert expected.keys() == actual.keys()
    assert len(expected) == files
    assert [name for name in expected if expected[name] != actual[name]] == []


def test_the_same_command_continues_a_killed_run_and_leaves_nothing_behind(killed_and_continued):
    project = killed_and_continued.project
    assert unfinished(project.folder) == set()
    assert killed_and_continued.locks == 2
    planned = project.dry_run("all", "--configfile", "config/smoke.yaml")
    assert not [path for path in planned.outputs if is_interrupted(path)]


def test_two_workflows_in_one_folder_exclude_each_other(killed_and_continued):
    assert killed_and_continued.second.returncode != 0
    assert "Directory cannot be locked" in killed_and_continued.second.stderr


def test_every_result_says_where_it_comes_from(smoke):
    results = smoke.folder / "results/smoke"
    written = [path for path in results.glob("**/*") if path.suffix in (".npz", ".pt", ".csv", ".md", ".png", ".pdf")]
    # The scenes are one result with one record, beside their folder.
    written = [path for path in written if "scenes" not in path.parts] + [results / "scenes/real_rgbd"]
    assert len(written) > 60
    files = [file for each in experiments() for tidy in each.tidy if tidy.takes_run for file in tidy.all_files]
    files += [file for result in registered() for file in result.all_files]
    of_sources = [file.format(source=source) for file in files for source in ("coffee_cup", "ycb")]
    given_the_run = {results / file for file in of_sources}
    for path in written:
        record = json.loads(path.with_name(path.name + ".provenance.json").read_text())
        of_run = {"config_read"} if path in given_the_run else set()
        assert set(record) == KEYS | of_run, path
        assert not of_run or set(record["config_read"]) == {"token", "keys"}, path
        for name, sha256 in record["inputs_sha256"].items():
            assert sha256 == hashlib.sha256((smoke.folder / name).read_bytes()).hexdigest(), (path, name)
    records = [json.loads(path.read_text()) for path in results.glob("**/*.provenance.json")]
    assert records[0]["config_sha256"].keys() >= {"seeds", "registrations", "sources"}
    assert all(record["config_sha256"] == records[0]["config_sha256"] for record in records)
