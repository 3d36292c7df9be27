"""A model file beside a mesh, to be spoiled and explained with; an explainer, and a pair to explain."""

import pytest
import trimesh

from gpca import Explainer
from gpca.rigid import inverse, transform

BALL = trimesh.creation.icosphere(3, radius=50)


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


@pytest.fixture(scope="package")
def explainer(model):
    return Explainer(model, device="cpu")


@pytest.fixture(scope="package")
def pair(registrations):
    """Source before ICP and target of a pose sample, in metres, the target's centre far from the origin."""
    row = next(i for i in registrations.rows("test") if registrations.concept[i] == "pose")
    T_source_target = inverse(registrations.T_target_source("icp", row))
    scale = registrations.diameter_m[row]
    source = transform(T_source_target, registrations.cloud(row).astype(float)) * scale
    return source, registrations.target(row).astype(float) * scale
