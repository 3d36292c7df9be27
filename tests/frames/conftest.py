"""A tiny dataset of the virtual camera: five objects, three tables, two views of each."""

import shutil

import pytest

from gpca.frames.rgbd_scene import write_scenes

from .tiny import read, scene_settings, surfaces


@pytest.fixture(scope="session")
def scenes(tmp_path_factory):
    """The dataset's folder; shared, so it is only read."""
    folder = tmp_path_factory.mktemp("scenes") / "tiny"
    write_scenes(surfaces(), "tiny", scene_settings(), folder)
    return folder


@pytest.fixture
def damaged(scenes, tmp_path):
    """A copy of the dataset, to be damaged."""
    shutil.copytree(scenes, tmp_path / "tiny")
    return tmp_path / "tiny"


@pytest.fixture(scope="session")
def tiny(scenes, tmp_path_factory):
    """Instances and objects of the dataset."""
    return read(scenes, tmp_path_factory.mktemp("objects") / "tiny.npz")
