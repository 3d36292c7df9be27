import logging
from types import SimpleNamespace

import pytest

from gpca.declarations.registry import steps
from gpca.process import time_left
from gpca.process.time_left import TIMES, TimeLeft, in_words, read_times, seconds_of, tell_time_left

from ..documents import ROOT

HEADER = "s\th:m:s\tmax_rss\n"


def count_of_jobs():
    record = logging.LogRecord("snakemake", logging.INFO, "", 0, None, (), None)
    record.event = "progress"
    return record


def test_the_time_left_is_the_work_for_each_core_or_the_longest_job():
    assert TimeLeft({"a": 30.0, "b": 60.0, "c": 45.0}, 2, bool, print).seconds() == pytest.approx((30 + 60 + 45) / 2)
    assert TimeLeft({"b": 60.0, "c": 45.0}, 2, bool, print).seconds() == 60
    assert TimeLeft({}, 2, bool, print).seconds() == 0


@pytest.mark.parametrize(("trust_s", "seconds"), [(120.0, 120 * 360 / 240), (1e-9, 240.0)])
def test_jobs_that_have_ended_correct_what_is_expected_of_the_others(tmp_path, trust_s, seconds):
    ended, now = tmp_path / "a.tsv", [0.0]
    ended.write_text(f"{HEADER}240\t0:04:00\t100.0\n")
    jobs, end = {str(ended): 120.0, "b": 120.0}, str(ended).__eq__
    left = TimeLeft(jobs, 1, end, print, trust_s=trust_s, clock=lambda: now[0])
    now[0] = 30.0
    left.emit(count_of_jobs())
    assert left.seconds() == pytest.approx(seconds)


def test_a_line_follows_a_count_of_jobs_but_not_each():
    now, ended, lines = [0.0], set(), []
    handler = TimeLeft({"a": 600.0, "b": 600.0}, 1, ended.__contains__, lines.append, clock=lambda: now[0])
    handler.emit(count_of_jobs())
    assert lines == []
    now[0] = 30.0
    ended.add("a")
    handler.emit(logging.LogRecord("snakemake", logging.INFO, "", 0, "something else", (), None))
    assert lines == []
    handler.emit(count_of_jobs())
    handler.emit(count_of_jobs())
    assert lines == ["about 10 minutes left"]


def test_a_run_begins_with_the_time_that_its_rules_took_and_says_nothing_where_none_was_measured(tmp_path, monkeypatch):
    # Let a run of two jobs begin with what is known of their times; the lines that it says.
    logger = logging.getLogger("snakemake.logging")
    monkeypatch.setattr(time_left, "TIMES", tmp_path / "times.csv")
    (tmp_path / "times.csv").write_text("run,rule,seconds\ndefault,objects,600\n")
    benchmarks = [tmp_path / "objects.tsv", tmp_path / "page.tsv"]
    jobs = [SimpleNamespace(benchmark=path, rule=SimpleNamespace(name=path.stem)) for path in benchmarks]

    def begun(run):
        dag = SimpleNamespace(needrun_jobs=lambda: jobs, finished=lambda job: False)
        lines, handlers = [], list(logger.handlers)
        monkeypatch.setattr("snakemake.logging.logger.info", lambda line, extra: lines.append(line))
        tell_time_left(SimpleNamespace(dag=dag, local_exec=True, cores=2), run)
        added = [handler for handler in logger.handlers if handler not in handlers]
        for handler in added:
            logger.removeHandler(handler)
        return lines, len(added)

    assert begun("default") == (["about 10 minutes left"], 1)
    assert begun("my_run") == ([], 1)
    time_left.TIMES.unlink()
    assert begun("default") == ([], 0)


@pytest.mark.parametrize("text", ["", HEADER, "h:m:s\n0:00:30\n", HEADER + "-\t-\t-\n"])
def test_a_benchmark_file_that_says_nothing_is_none(tmp_path, text):
    path = tmp_path / "job.tsv"
    assert seconds_of(path) is None
    path.write_text(text)
    assert seconds_of(path) is None
    path.write_text(HEADER + "1.5\t0:00:01\t9\n2.0\t0:00:02\t9\n")
    assert seconds_of(path) == 3.5


def test_the_times_that_come_with_the_workflow_are_those_of_its_rules():
    rules = "".join(path.read_text() for path in (ROOT / "workflow/rules").rglob("*.smk"))
    rules += "".join(f"rule {step.name}:" for step in steps())  # of experiments
    times = read_times(TIMES)
    assert set(times) == {"default", "full"}
    for of_run in times.values():
        assert all(seconds >= 0 for seconds in of_run.values())
        assert f"rule {max(of_run, key=of_run.get)}:" in rules


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(29, "less than a minute"), (60, "about 1 minute"), (2100, "about 35 minutes"), (9000, "about 2.5 hours")],
)
def test_the_time_is_told_in_words(seconds, words):
    assert in_words(seconds) == f"{words} left"
