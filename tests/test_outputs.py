"""Outputs that cannot be written are found before the work, and nothing that is there is lost to them."""

import os
from pathlib import Path

import pytest

from gpca.errors import InputError
from gpca.io.files import require_outputs

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
    [(["a", "b", "a"], []), (["a"], ["a"]), (["a"], ["b", "./c/../a"]), (["a"], ["link"]), (["link"], ["a"])],
)
def test_one_file_is_not_written_twice_nor_over_what_is_read(tmp_path, monkeypatch, outputs, inputs):
    monkeypatch.chdir(tmp_path)
    Path("a").write_text("")
    Path("link").symlink_to("a")
    with pytest.raises(InputError, match="is also an input or another output; give each file its own name"):
        require_outputs(outputs, inputs)


def test_what_can_be_written_passes(folder):
    require_outputs([folder / "new" / "deep" / "a.npz", folder / "file", "b"], [folder / "taken"])
    require_outputs([folder / "taken", folder / "new"], folders=True)
    assert not (folder / "new").exists()
