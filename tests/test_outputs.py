"""Outputs that cannot be written are found before the work, and nothing that is there is lost to them."""

import os
import resource
from pathlib import Path

import pytest

from gpca.__main__ import main
from gpca.errors import InputError
from gpca.io.files import append_row, require_outputs, whole_file, whole_folder

from .hostile import refusal

OBJECTS = ["objects", "--source", "mine", "--settings", '{"kind": "procedural", "family": "ycb"}', "--out"]
SCENES = ["scenes", "--source", "mine", "--settings", '{"families": ["ycb"], "count": 2, "views": 1}', "--out"]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "thesis.tex").write_text("years of work")
    (tmp_path / "file").write_text("text")
    (tmp_path / "loop").symlink_to("loop")
    os.mkfifo(tmp_path / "fifo")
    return tmp_path


@pytest.mark.parametrize(
    ("out", "word"),
    [
        ("taken", "is not a file"),
        (".", "is not a file"),
        ("..", "is not a file"),
        ("/", "is not a file"),
        ("fifo", "is not a file"),
        ("file/objects.npz", "is not a folder"),
        ("file/deeper/objects.npz", "is not a folder"),
        ("/proc/objects.npz", "written"),
        ("x" * 300, "too long"),
        ("loop/objects.npz", "loop"),
    ],
)
def test_an_output_that_cannot_be_written(folder, out, word):
    refusal([*OBJECTS, out], folder, word)


@pytest.mark.parametrize("out", ["file", "fifo", "file/scenes"])
def test_scenes_replace_no_folder_but_their_own(folder, out):
    refusal([*SCENES, out], folder, "folder")
    assert (folder / "taken" / "thesis.tex").is_file()


@pytest.mark.parametrize(
    ("outputs", "inputs"),
    [
        (["a", "b", "a"], []),
        (["a"], ["a"]),
        (["a"], ["b", "./c/../a"]),
        (["a"], ["link"]),
        (["link"], ["a"]),
        (["hard"], ["a"]),
    ],
)
def test_one_file_is_not_written_twice_nor_over_what_is_read(tmp_path, monkeypatch, outputs, inputs):
    monkeypatch.chdir(tmp_path)
    Path("a").write_text("")
    Path("link").symlink_to("a")
    os.link("a", "hard")
    with pytest.raises(InputError, match="is also an input or another output; give each file its own name"):
        require_outputs(outputs, inputs)


def test_what_can_be_written_passes(folder):
    require_outputs([folder / "new" / "deep" / "a.npz", folder / "file", "b"], [folder / "taken"])
    require_outputs([folder / "taken", folder / "new"], folders=True)
    assert not (folder / "new").exists()


@pytest.mark.parametrize(
    "words",
    [
        "bench causes my.py --out my.py",
        "bench causes my --out ./my.py",
        "bench causes chance --samples A --out A/tables/x.md",
        "leaderboard --submissions A --out A/a.csv",
        "compare A B --out A/tables/x.md",
        "compare A B --out A/a.csv",
        "ship-predictions --run A --out A",
        "explain my.py my.py --html A/causes.npz",
        "explain --pairs A/a.csv --json-lines --queue B/cloud.ply",
        "label my.py --labels labels.csv --picture my.py",
    ],
)
def test_no_command_writes_over_what_it_reads(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GPCA_MODEL", "A/causes.npz")
    Path("A/tables").mkdir(parents=True)
    Path("B").mkdir()
    for name in ("my.py", "A/tables/x.md", "A/causes.npz", "B/cloud.ply"):
        Path(name).write_text("years of work")
    Path("A/a.csv").write_text("source,target\n../my.py,../B/cloud.ply\n")
    assert main(words.split()) == 2
    assert "is also an input or another output" in capsys.readouterr().err
    assert Path("my.py").read_text() == "years of work"


@pytest.mark.parametrize("words", ["leaderboard --submissions A --out A/new.csv", "compare A A --out A/new.md"])
def test_no_page_is_taken_for_a_table(tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    Path("A").mkdir()
    assert main(words.split()) == 2
    assert "is the name of no page; let it end in .html" in capsys.readouterr().err


def test_a_file_that_is_no_queue_is_refused_at_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("notes").write_text("years of work")
    assert main(["explain", "missing.ply", "missing.ply", "--queue", "notes"]) == 2
    assert "notes: is not a queue; name another file with --queue" in capsys.readouterr().err


def test_a_row_is_added_on_a_line_of_its_own(tmp_path):
    path = tmp_path / "labels.csv"
    path.write_text("sample,concept\n1,pose")
    append_row(path, (2, "noise"), ("sample", "concept"))
    assert path.read_text() == "sample,concept\n1,pose\n2,noise\n"


@pytest.mark.parametrize("write", ["file", "folder", "row"])
def test_a_full_disk_is_named_with_what_was_to_be_written(tmp_path, write):
    path, big = tmp_path / "out", "x" * 9000
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, limits[1]))
    try:
        with pytest.raises(InputError, match=r"out: cannot be written: no space left on the disk of .*; free some"):
            if write == "row":
                append_row(path, (big,), ("head",))
            elif write == "file":
                with whole_file(path) as partial:
                    partial.write_text(big)
            else:
                with whole_folder(path) as partial:
                    (partial / "a").write_text(big)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert [each.stat().st_size for each in tmp_path.iterdir()] == [0] * (write == "row")
