"""A folder where every step has run by hand."""

import shutil

import pytest

from gpca.__main__ import main

from .command_lines import STEP_OPTIONS, arguments

# The files of a second source that some steps read besides.
OF_ANOTHER_SOURCE = {
    "objects": {"--out": "objects_other.npz"},
    "registrations": {"--objects": "objects_other.npz", "--out": "other.npz", "--timings": "other_icp.csv"},
    "train": {"--registrations": "other.npz", "--out": "other.pt", "--curve": "other_curve.csv"},
}


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
        for step in STEP_OPTIONS:
            assert main(arguments(step)) == 0
            if step in OF_ANOTHER_SOURCE:
                assert main(arguments(step, {"--source": "other", **OF_ANOTHER_SOURCE[step]})) == 0
    return folder


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """A copy of that folder to spoil, and the working folder."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path
