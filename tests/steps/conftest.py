"""A folder where every step has run by hand."""

import shutil

import pytest

from tests.steps.by_words import main

from .command_lines import every_step
from .six_objects import six  # noqa: F401


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """A folder where every step has run by hand, one after the other."""
    import trimesh

    folder = tmp_path_factory.mktemp("made")
    (folder / "meshes").mkdir()
    trimesh.creation.box((40, 70, 100)).export(folder / "meshes/brick.stl")
    trimesh.creation.cone(30, 90).export(folder / "meshes/cone.ply")
    (folder / "answers.txt").write_text("overlap\nocclusion\n/skip\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for words in every_step():
            assert main(words) == 0
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """A copy of that folder to spoil, and the working folder."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path
