"""A model file beside a mesh, to be spoiled and explained with; an explainer, and a pair to explain."""

import json
import zipfile

import numpy as np
import pytest
import torch
import trimesh

from gpca import Explainer
from gpca.rigid import inverse, transform

BALL = trimesh.creation.icosphere(3, radius=50)


def write_anything(path, content):
    """Write a model file without the checks of the writer."""
    arrays = []

    def plain(part):
        if isinstance(part, np.ndarray | np.generic):
            arrays.append(np.asarray(part))
            return {"array": f"array {len(arrays) - 1}"}
        if isinstance(part, dict):
            return {name: plain(inner) for name, inner in part.items()}
        return [plain(inner) for inner in part] if isinstance(part, list) else part

    text = json.dumps(plain(content))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("content.json", text)
        for number, array in enumerate(arrays):
            with archive.open(f"array {number}.npy", "w") as member:
                np.lib.format.write_array(member, array)


def in_version_4(part):
    """What torch wrote in the place of a model's content: tensors, and gpytorch's free parameters and bounds."""
    if isinstance(part, np.ndarray):
        return torch.from_numpy(part.copy())
    if isinstance(part, list):
        return [in_version_4(inner) for inner in part]
    if not isinstance(part, dict):
        return part
    part = {name: in_version_4(inner) for name, inner in part.items() if name != "usual_distance"}
    if "kernel" in part and isinstance(part["kernel"], dict):
        scale, parameter = (values + torch.log(-torch.expm1(-values)) for values in part["kernel"].values())
        part["kernel"] = {
            "raw_outputscale": scale.float(), "base_kernel.raw_lengthscale": parameter.float()[:, None, None],
            "raw_outputscale_constraint.lower_bound": torch.tensor(0.0),
            "raw_outputscale_constraint.upper_bound": torch.tensor(float("inf")),
        }  # fmt: skip
    return part | {"version": 4} if "version" in part else part


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
