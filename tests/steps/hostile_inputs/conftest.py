"""One good file of each kind that a later step reads of an earlier one, and a copy of them to be spoiled."""

import shutil

import numpy as np
import pytest

from gpca.io.arrays import save_arrays
from gpca.uncertainty.settings import CONDITIONS

K = len(CONDITIONS["removal"])


@pytest.fixture(scope="package")
def made(objects, registrations, tmp_path_factory):
    """One good file of each kind, by which the bad ones are made."""
    folder = tmp_path_factory.mktemp("made")
    random = np.random.default_rng(0)
    n = len(registrations)
    objects.save(folder / "objects.npz", "tiny")
    registrations.save(folder / "registrations.npz")
    of_samples = {"sample": registrations.sample, "split": registrations.split}
    embeddings = {"h": random.normal(size=(n, 8)), "head_logits": random.normal(size=(n, 3))}
    save_arrays(folder / "embeddings.npz", embeddings | of_samples, registrations.axes)
    outcomes = {"covariance": np.tile(np.eye(6), (n, K, 1, 1)), "uncertainty": random.normal(size=(n, K))}
    outcomes |= {"residual": np.ones((n, K)), "degenerate": np.zeros((n, K), bool), "icp_calls": np.ones((n, K), int)}
    save_arrays(folder / "uncertainty.npz", outcomes | of_samples, registrations.axes)
    lines = [f"{s},{split},0.5,0.5" for s, split in zip(registrations.sample, registrations.split, strict=True)]
    (folder / "seconds.csv").write_text("\n".join(["sample,split,seconds,icp_seconds", *lines, ""]))
    lines = [f"{s},{split},{k},0.5,0.5" for s, split in zip(*of_samples.values(), strict=True) for k in range(K)]
    (folder / "conditions.csv").write_text("\n".join(["sample,split,condition,seconds,icp_seconds", *lines, ""]))
    return folder


@pytest.fixture
def folder(made, tmp_path):
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path
