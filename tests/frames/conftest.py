"""What tests of frames damage."""

import shutil

import pytest


@pytest.fixture
def damaged(scenes, tmp_path):
    """A copy of the tiny dataset, to be damaged."""
    shutil.copytree(scenes, tmp_path / "tiny")
    return tmp_path / "tiny"
