"""The commands of the tracks, from a method in a file to its row, and from a CSV to the page."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from gpca.__main__ import main
from gpca.alignment.icp import ICPSettings
from gpca.process import plugins
from gpca.reenactment.settings import ReenactmentSettings
from gpca.steps.repair import RepairSettings, World, searched, try_all
from gpca.tracks import leaderboard, samples
from gpca.tracks import published as published_module
from gpca.tracks.leaderboard import MARK

from ..accessible import faults_of
from .conftest import SEED, SOURCE

FILE = f"causes/{SOURCE}/seed{SEED}.npz"


def test_a_method_in_a_file_stands_among_the_published_rows(method, published, run, tmp_path, capsys):
    assert main(["bench", "causes", method, "--samples", str(run), "--out", "said.csv", "--authors", "Me"]) == 0
    shown = capsys.readouterr().out
    assert f"{MARK}RMSE below its median" in shown and "Minus RMSE below its median (points)" in shown
    said = (tmp_path / "said.csv").read_text()
    assert said.startswith(f"# track: causes\n# version: {published.version}\n# method: RMSE below its median\n")
    assert said.count(f"\n{SOURCE},") == len(published.rows)
    assert main(["score", "causes", "said.csv"]) == 0
    again = capsys.readouterr().out
    [row], [other] = (re.findall(f"^{MARK}.+$", text, re.MULTILINE) for text in (shown, again))
    assert row.split() == other.split()


def test_an_explainer_of_the_suite_can_be_run_again(published, run, apart, capsys):
    assert main(["bench", "causes", "chance", "--samples", str(run)]) == 0
    assert f"{MARK}Chance (here)" in capsys.readouterr().out
    assert plugins.named() == []


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["causes", "none.py"], "none.py: no such file"),
        (["causes", "none_such"], "explainer 'none_such': unknown; choose one of "),
        (["hard", "my_method.py"], "my_method.py: lists no EXPLAINERS, whom the track hard asks; give it EXPLAINERS"),
        (["repair", "my_method.py"], "my_method.py: has no function repair, which the track repair asks; give it def"),
        (["repair", "my_method.py", "--out", "x.csv"], "--out: is no option of the track repair; leave it out"),
        (["clouds", "my_method.py"], "track 'clouds': unknown; choose one of causes, hard, frames"),
        (["causes", "my_method.py", "--link", "javascript:alert(1)"], "--link: is 'javascript:alert(1)'; give an a"),
        (["causes", "leaves.py"], "leaves.py: cannot be imported (SystemExit: 0)"),
        (["causes", "number.py"], "number.py: lists no CAUSE_EXPLAINERS"),
        (["causes", "above.py"], "CAUSE_EXPLAINERS has the name '../x'; use letters, digits and underscores"),
        (["causes", "two_lines.py"], "has the title 'a\\n# link: b'; give a line of at most 200 letters"),
        (["causes", "my_method.py", "--settings", json.dumps({"sharp": 1})], "setting sharp: unknown"),
    ],
)
def test_a_method_that_cannot_be_asked_is_refused_in_one_line(words, line, method, published, run, tmp_path, capsys):
    text = (tmp_path / method).read_text()
    (tmp_path / "leaves.py").write_text("raise SystemExit(0)\n")
    (tmp_path / "number.py").write_text("CAUSE_EXPLAINERS = 5\n")
    (tmp_path / "above.py").write_text(text.replace('{"rmse"', '{"../x"'))
    (tmp_path / "two_lines.py").write_text(text.replace("RMSE below its median", "a\\n# link: b"))
    assert main(["bench", *words, "--samples", str(run)]) == 2
    said = [text for text in capsys.readouterr().err.splitlines() if "learning and" not in text]
    assert len(said) == 1 and line in said[0]


def test_a_function_stands_among_the_repairs_even_if_it_is_named_like_one(
    shipped, causes, four, config, tmp_path, monkeypatch, capsys
):
    few = causes.subset(np.arange(3))
    registrations = replace(few.registrations, split=np.full(len(few), "test"), axes=(SOURCE, SEED))
    few = replace(few, registrations=registrations, truth_again=few.truth)
    found = lambda pair, _row: searched(pair, ReenactmentSettings())  # noqa: E731
    world = World(few, {}, four)
    attempts, _ = try_all(world, RepairSettings(), ICPSettings(), "model", found, (SOURCE, SEED))
    few.save(tmp_path / FILE)
    four.save(tmp_path / f"objects/{SOURCE}.npz", SOURCE)
    attempts.save(tmp_path / f"repairs/{FILE}", (SOURCE, SEED))
    monkeypatch.setattr(published_module, "FOLDER", tmp_path)
    replace(shipped, hashes={}).save(tmp_path / "causes.npz")
    monkeypatch.setattr(samples.TrackSamples, "config", config | {"success": {"error": 0.03}})
    monkeypatch.chdir(tmp_path)
    for name, answer in (("repair", "T_init, 1.0"), ("fails", "source[10**9]")):
        (tmp_path / f"{name}.py").write_text(f"def repair(source, target, T_init):\n    return {answer}\n")
    assert main(["bench", "repair", "repair.py", "--samples", "."]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert [sum(title in row for row in rows) for title in ("→ repair (here) ", "(here), by the judge")] == [1, 1]
    assert main(["bench", "repair", "fails.py", "--samples", "."]) == 2
    assert "fails.py, line 2: IndexError: " in capsys.readouterr().err.splitlines()[-1]


SUMMARY = "    def summary(self, registrations):\n        n = len(registrations)\n        return {}, None, None\n"
OTHER_LABELS = "    labels = ('noise', 'pose', 'overlap', {})\n" + SUMMARY.format("np.zeros((n, 4))")


@pytest.mark.parametrize(
    ("body", "line"),
    [
        (SUMMARY.format("None"), "explainer Own: scores_N_C: is of type NoneType, not an array"),
        (SUMMARY.format("np.zeros(n)"), "not N×4"),
        (SUMMARY.format("np.zeros((n + 1, 4))"), "answers for 21 registrations, and is asked about 20; give one row"),
        (SUMMARY.format("np.zeros((n, 4), complex)"), "has type complex128"),
        (SUMMARY.format("np.full((n, 4), np.nan)"), "contains NaN"),
        (
            "    def explain(self, registrations):\n        from gpca.classifier.scores import Attribution\n"
            "        return Attribution.of_scores(LABELS, np.zeros((20, 4)), seconds=1j)\n",
            "seconds or calls: has type complex128",
        ),
        (OTHER_LABELS.format("'fog'"), "scores noise, pose, overlap, fog; score nominal, noise, pose, overlap"),
        (OTHER_LABELS.format("'pose'"), "concepts: are ('noise', 'pose', 'overlap', 'pose'); give different names"),
        ("    def explain(self, registrations):\n        return 5\n", "answers with a int"),
        (SUMMARY.format("1 / 0"), "own.py, line 10: ZeroDivisionError: division by zero"),
        (SUMMARY.format("sys.exit(0)"), "own.py, line 10: SystemExit: 0"),
    ],
)
def test_an_answer_that_cannot_be_is_refused_in_one_line(body, line, method, published, run, tmp_path, capsys):
    head = (
        "import sys\nimport numpy as np\nfrom gpca.causes.dataset import LABELS\n"
        "from gpca.explainers.interface import ExplainerEntry, ScoringExplainer\n"
        "class Own(ScoringExplainer):\n    labels = LABELS\n\n"
    )
    (tmp_path / "own.py").write_text(f"{head}{body}CAUSE_EXPLAINERS = {{'own': ExplainerEntry('Own', Own, ())}}\n")
    assert main(["bench", "causes", "own.py", "--samples", str(run)]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2 and line in said[1]


def test_a_method_is_tried_on_few_samples_before_all_are_made(
    method, published, causes, tmp_path, monkeypatch, apart, capsys
):
    text = (tmp_path / method).read_text()
    (tmp_path / "own.py").write_text(text.replace("return np.column_stack", "return [] or 1 / 0, np.column_stack"))
    folders, few = [], replace(causes, registrations=replace(causes.registrations, axes=("ycb", 0)))

    def make(names, folder, config, _processes):
        folders.append(folder)
        assert config["causes"]["test"] == 10
        for name in names:
            few.save(folder / name)

    monkeypatch.setattr(samples, "make", make)
    assert main(["bench", "causes", "own.py", "--samples", str(tmp_path / "none")]) == 2
    assert "ZeroDivisionError" in capsys.readouterr().err
    assert folders and tmp_path / "none" not in folders


def test_a_fault_of_predictions_is_one_line_and_the_status_says_so(published, tmp_path, capsys):
    (tmp_path / "said.csv").write_text("# track: causes\nsource,seed,sample\n")
    assert main(["score", "causes", str(tmp_path / "said.csv")]) == 2
    said = capsys.readouterr()
    assert "its head lacks 'version'" in said.err and len(said.err.splitlines()) == 1 and said.out == ""


@pytest.fixture
def board(published, run, method, tmp_path, monkeypatch, capsys):
    """A folder with one submission."""
    monkeypatch.setattr(leaderboard, "PUBLISHED", tmp_path / "published")
    words = ["--samples", str(run), "--out", "board/rmse.csv", "--authors", "<b>Me</b>"]
    (tmp_path / "board").mkdir()
    assert main(["bench", "causes", method, *words, "--link", "https://github.com/me/rmse"]) == 0
    capsys.readouterr()
    return tmp_path / "board"


def test_the_page_ranks_submissions_and_can_be_sorted(board, capsys):
    assert main(["leaderboard", "--submissions", str(board)]) == 0
    assert "submissions: 1 of the track causes" in capsys.readouterr().out
    page = (board / "index.html").read_text()
    assert page.count('<tr class="submitted">') == 2  # among all tracks, and in its own
    assert '<a href="https://github.com/me/rmse" rel="nofollow">' in page
    assert "&lt;b&gt;Me&lt;/b&gt;" in page and "<b>Me" not in page
    assert "http" not in page.replace("https://github.com/me/rmse", "")  # nothing is fetched
    assert faults_of(page) == []
    tables, heads = (re.findall(f"<{tag}>(.*?)</{tag}>", page, re.DOTALL) for tag in ("tbody", "thead"))
    for table, head, count in zip(tables, heads, (3, 4), strict=True):  # the ceiling has no rank
        rows = re.findall(r"<tr.*?</tr>", table, re.DOTALL)
        assert {len(re.findall("<t[dh]", row)) for row in rows} == {head.count("<th ")} and len(rows) == count


def test_a_name_stands_on_a_track_once(board, capsys):
    (board / "again.csv").write_text((board / "rmse.csv").read_text())
    assert main(["leaderboard", "--submissions", str(board), "--check"]) == 2
    assert "rmse.csv: its method has the name of another one; give it a name of its own" in capsys.readouterr().err


def test_the_submissions_of_the_repository_are_without_fault():
    assert main(["leaderboard", "--check"]) == 0


def test_a_faulty_submission_makes_no_page(board, capsys):
    text = (board / "rmse.csv").read_text()
    (board / "rmse.csv").write_text(text.replace(f"\n{SOURCE},100,0,", f"\n{SOURCE},100,99,"))
    assert main(["leaderboard", "--submissions", str(board), "--check"]) == 2
    assert "sample 99 is no test sample" in capsys.readouterr().err
    assert not (board / "index.html").exists()
