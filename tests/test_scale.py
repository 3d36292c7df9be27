"""What a run scales to, by the plan of the smoke run and made-up seconds; a larger run is configured, not planned."""

import json

import pytest

from benchmarks import scale
from benchmarks.schedule import Job
from gpca.config.check import check
from gpca.config.layers import without_false
from gpca.errors import InputError
from gpca.process.time_left import read_times

from .config.configs import load, merged

HEADER = "s\th:m:s\tmax_rss\n"


@pytest.fixture
def run_folder(smoke_plan, tmp_path, monkeypatch):
    """A run in which every job took 30 s; the larger run has the same jobs."""
    monkeypatch.setattr(scale, "plan", lambda run, *_: smoke_plan.replace("results/smoke/", f"results/{run}/"))
    folder = tmp_path / "smoke"
    for job in scale.read_plan(smoke_plan, "smoke"):
        (folder / job.benchmark).parent.mkdir(parents=True, exist_ok=True)
        (folder / job.benchmark).write_text(HEADER + "30.0\t0:00:30\t100.0\n")
    return folder


def test_more_cores_are_faster_until_the_longest_chain_is_all_that_is_left(run_folder, capsys):
    assert scale.main([str(run_folder), "--cores", "1", "2", "999"]) == 0
    lines = capsys.readouterr().out.splitlines()
    found = json.loads(lines[-1])
    jobs = len(list(run_folder.rglob("*.tsv")))
    assert found["speedup_1"] == 1
    assert 1.9 < found["speedup_2"] <= 2
    assert found["speedup_999"] == pytest.approx(30 * jobs / found["critical_s"], abs=0.01)
    assert "`page` 30)." in lines[-2]


def test_the_same_run_on_a_cluster_takes_the_same_and_the_tables_are_written(run_folder, tmp_path, capsys):
    page = tmp_path / "page.md"
    page.write_text("<!-- times of results/smoke at scale -->\nold\n<!-- end of results/smoke at scale -->\n")
    assert scale.main([str(run_folder), "--sources", "3", "--write", str(page)]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["jobs"] == len(list(run_folder.rglob("*.tsv"))) > found["submitted"] > 50
    assert found["core_h"] == pytest.approx(found["jobs"] * 30 / 3600, abs=0.06)
    assert f"| jobs, and of these in the queue | {found['jobs']}, {found['submitted']} |" in page.read_text()
    assert "| 3 datasets, 10 seeds, 20 explainers |" in page.read_text()


def test_a_job_grows_with_the_results_it_reads_and_writes():
    def job(rule, inputs, outputs):
        return Job(inputs, outputs, rule, 0, 1, rule)

    jobs = [job("register", ("code.py",), ("a",)), job("metrics", ("a", "code.py"), ("t",))]
    seconds = {"register": 10.0, "metrics": 4.0}
    more = [job("register", ("code.py",), ("a", "b", "c")), job("metrics", ("a", "b", "c"), ("t",))]
    more += [job("timings", ("t",), ("u",)), job("a_new_rule", (), ("v",))]
    assert scale.estimated(jobs, seconds, more) == {"register": 30, "metrics": 8, "timings": 4, "a_new_rule": 10}


def test_a_larger_run_has_as_many_of_each_and_passes_the_check():
    config = without_false(merged(load(), scale.larger_config(7, 4, 20)))
    sources = check(config)
    assert (len(sources), len(config["seeds"]), len(config["explainers"])) == (7, 4, 20)
    assert "transfer" not in config["controls"]["controls"]
    assert {entry["kind"] for entry in sources.values()} == {"bop", "mesh_folder"}
    with pytest.raises(InputError, match="--sources 2: cannot be planned; give 3 to"):
        scale.larger_config(2, 4, 20)


def test_a_run_that_was_not_made_is_expected_from_the_times_of_its_rules(run_folder, tmp_path, capsys):
    jobs = len(list(run_folder.rglob("*.tsv")))
    expect = [str(run_folder), "--cores", "1", "2", "--expect", str(tmp_path / "other.yaml"), "--rules", "99"]
    assert scale.main(expect) == 0
    same = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert same["core_min"] == pytest.approx(jobs / 2, rel=0.01)  # rates are means over the jobs of a rule
    assert scale.main([*expect, "--given", "train_*=2x", "encoders/*=90s"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("| `train_encoder` | ") and line.endswith(" | 1.5 |") for line in lines)
    assert json.loads(lines[-1])["core_min"] > same["core_min"]
    # By the times of the checkout no run has to be there.
    absent = [str(tmp_path / "full"), "--expect", str(tmp_path / "other.yaml"), "--means"]
    assert scale.main(absent) == 0
    kept = json.loads(capsys.readouterr().out.splitlines()[-1])["core_min"]
    assert scale.main([*absent, "--given", "train_*=1000x"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["core_min"] > kept > 0
    assert scale.main([str(tmp_path / "other"), *absent[1:]]) == 2
    assert "has no times of a run other" in capsys.readouterr().err
    for value, fault in {"page=2": "is no factor or time", "no_rule=2x": "names no job of the plan"}.items():
        assert scale.main([*expect, "--given", value]) == 2
        assert f"--given {value}: {fault}; " in capsys.readouterr().err


def test_the_times_of_rules_are_kept_for_later_runs(run_folder, tmp_path, monkeypatch):
    times = tmp_path / "times.csv"
    times.write_text("run,rule,seconds\nfull,page,5.00\nsmoke,gone,1.00\n")
    monkeypatch.setattr(scale, "TIMES", times)
    assert scale.main([str(run_folder), "--times"]) == 0
    rules = {job.rule for job in scale.read_plan(scale.plan("smoke", None, []), "smoke")}
    assert read_times(times) == {"full": {"page": 5.0}, "smoke": dict.fromkeys(rules, 30.0)}
