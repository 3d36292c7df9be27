"""What a target takes, summed over the jobs of Snakemake's own plan, on made-up benchmark files."""

import json
import re

import pytest

from benchmarks import targets
from benchmarks.schedule import Job, critical_path, wall_time
from benchmarks.targets import cost, read_plan

HEADER = "s\th:m:s\tmax_rss\tmax_vms\tmax_uss\tmax_pss\tio_in\tio_out\tmean_load\tcpu_time\n"
TABLE2 = 2 + 4 + 4 + 4 + 4 + 1  # objects, registrations, encoders, embeddings, GP-CA twice for two sources; the table


def job(name, *inputs, priority=0, threads=1):
    return Job(inputs, (name,), f"benchmarks/{name}.tsv", priority, threads)


@pytest.fixture
def run_folder(smoke_plan, tmp_path):
    """A run in which every job took 30 s and 100 MB, but one training 300 s and 900 MB."""
    folder = tmp_path / "smoke"
    for planned in read_plan(smoke_plan, "smoke"):
        path = folder / planned.benchmark
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(HEADER + "30.0\t0:00:30\t100.0\t0\t0\t0\t0\t0\t100\t30\n")
    long = folder / "benchmarks/encoders/ycb/dgcnn/seed1.tsv"
    long.write_text(HEADER + "300.0\t0:05:00\t900.0\t0\t0\t0\t0\t0\t100\t30\n")
    return folder


def test_wall_time_keeps_order_cores_and_priority_and_the_critical_path_is_the_longest_chain():
    seconds = dict.fromkeys((f"benchmarks/{name}.tsv" for name in "abcd"), 10.0) | {"benchmarks/a.tsv": 25.0}
    chain = [job("a"), job("b", "a"), job("c", "b")]
    assert wall_time(chain, seconds, cores=2) == 45
    side_by_side = [job("a"), job("b"), job("c"), job("d")]
    assert wall_time(side_by_side, seconds, cores=1) == 55
    assert wall_time(side_by_side, seconds, cores=2) == 30
    late = [job("a"), job("b", priority=1), job("c", priority=1), job("d", "c")]
    assert wall_time(late, seconds, cores=2) == 35  # a waits until b or c ends
    assert wall_time([job("a", threads=2), job("b")], seconds, cores=2) == 35
    assert wall_time([job("a", threads=8)], seconds, cores=2) == 25
    seconds = {f"benchmarks/{name}.tsv": value for name, value in {"a": 5, "b": 9, "c": 1, "d": 2, "e": 3}.items()}
    jobs = [job("e", "c", "d"), job("c", "a"), job("d", "b"), job("b"), job("a", "from_outside")]
    assert [each.outputs[0] for each in critical_path(jobs, seconds)] == ["b", "d", "e"]
    assert critical_path([], {}) == []
    assert wall_time(jobs, seconds, cores=9) == 14


def test_a_target_counts_its_own_jobs_once_each(smoke_plan, run_folder):
    jobs = read_plan(smoke_plan, "smoke")
    by_target = targets.targets(jobs)
    table2 = cost(by_target["tables/table2_per_concept.md"], run_folder, cores=2)
    assert table2.jobs == TABLE2
    assert table2.core_s == pytest.approx(30 * TABLE2 + 270)
    assert table2.core_s / 2 <= table2.wall_s <= table2.core_s
    assert table2.peak_mb == 900
    objects = cost(by_target["figures/objects_ycb.png"], run_folder, cores=2)
    assert (objects.jobs, objects.wall_s, objects.peak_mb) == (2, 60, 100)
    assert {"tables/table6_backbones.md", "figures/fig3_concepts.png", "metrics.csv"} < set(by_target)
    assert cost(jobs, run_folder, cores=2).jobs == len(list(run_folder.rglob("*.tsv")))


def test_a_target_with_a_job_that_was_not_recorded_is_not_measured(smoke_plan, run_folder):
    (run_folder / "benchmarks/objects/ycb.tsv").unlink()
    by_target = targets.targets(read_plan(smoke_plan, "smoke"))
    assert cost(by_target["figures/objects_ycb.png"], run_folder, cores=2) is None
    assert cost(by_target["figures/objects_coffee_cup.png"], run_folder, cores=2).jobs == 2


def test_the_command_prints_the_table_and_writes_it_into_its_page(
    smoke_plan, run_folder, tmp_path, monkeypatch, capsys
):
    jobs = [found.start() for found in re.finditer(r"^(?:local)?rule ", smoke_plan, re.MULTILINE)]
    half = smoke_plan[: jobs[len(jobs) // 2]]
    plans = {"all": smoke_plan, "paper": half}
    monkeypatch.setattr(targets, "plan", lambda run, configfile, config, target: plans[target])
    page = tmp_path / "page.md"
    page.write_text("Before.\n\n<!-- times of results/smoke -->\nold\n<!-- end of results/smoke -->\n\nAfter.\n")
    for _ in range(2):  # the second writing replaces the first
        assert targets.main([str(run_folder), "--write", str(page)]) == 0
    out = capsys.readouterr().out
    assert json.loads(out.splitlines()[-1])["peak_mb"] == 900
    text = page.read_text()
    assert text.startswith("Before.\n\n<!-- times of results/smoke -->\n\n| target |")
    assert text.endswith("<!-- end of results/smoke -->\n\nAfter.\n")
    assert "old" not in text
    assert text.count("| `tables/table7_runtime.md` |") == text.count("| `model.pt` |") == text.count("| `all` |") == 1
    jobs_of = {name: int(re.search(rf"^\| `{name}` \| (\d+) \|", text, re.MULTILINE)[1]) for name in plans}
    assert 0 < jobs_of["paper"] < jobs_of["all"]
    row = "| `figures/objects_ycb.png` | 2 | 1.0 | 1.0 | 100 |\n"
    assert (out.count(row), text.count(row)) == (2, 0)  # printed each time, but not on the page


def test_faults_are_one_line_and_status_2(smoke_plan, run_folder, tmp_path, monkeypatch, capsys):
    assert targets.main([str(tmp_path / "nowhere")]) == 2
    assert "nowhere: has no benchmark files; name the folder of a finished run" in capsys.readouterr().err
    monkeypatch.setattr(targets, "plan", lambda run, configfile, config, target: smoke_plan)
    (tmp_path / "page.md").write_text("No place.\n")
    assert targets.main([str(run_folder), "--write", str(tmp_path / "page.md")]) == 2
    err = capsys.readouterr().err
    assert "page.md: has no place for results/smoke; add the lines '<!-- times of results/smoke -->' and" in err
    assert (tmp_path / "page.md").read_text() == "No place.\n"
    (run_folder / "benchmarks/objects/ycb.tsv").write_text("nothing\n")
    assert targets.main([str(run_folder)]) == 2
    assert "ycb.tsv: has no number 's'; repeat the run" in capsys.readouterr().err
