"""A model file beside a mesh, to be spoiled and explained with."""

import pytest

from .spoiled import BALL


@pytest.fixture(scope="module")
def saved(model, tmp_path_factory):
    path = tmp_path_factory.mktemp("saved") / "model.pt"
    model.save(path)
    return path


@pytest.fixture
def folder(saved, tmp_path):
    (tmp_path / "model.pt").write_bytes(saved.read_bytes())
    BALL.export(tmp_path / "ball.ply")
    return tmp_path
