import os
import pickle

import numpy as np
import pytest
import torch

from gpca.errors import InputError
from gpca.model.file import Model
from gpca.model.location import VARIABLE, model_path


@pytest.fixture
def path(model, tmp_path):
    model.save(tmp_path / "model.pt")
    return tmp_path / "model.pt"


def embeddings(model, n=5):
    return np.random.default_rng(0).normal(size=(n, model.encoder.embedding_size)).astype(np.float32)


def test_a_loaded_model_says_the_same(model, path):
    loaded = Model.load(path)
    cloud = torch.rand(1, 64, 3)
    with torch.inference_mode():
        assert torch.equal(loaded.encoder(cloud), model.encoder(cloud))
    h = embeddings(model)
    for expected, actual in zip(model.gpc.attribute(h), loaded.gpc.attribute(h), strict=True):
        np.testing.assert_array_equal(actual, expected)
    for name in ("encoder_settings", "icp", "cloud_points", "policy", "title", "stand_in", "familiar"):
        assert getattr(loaded, name) == getattr(model, name)


def test_a_loaded_classifier_learns_what_the_saved_one_would(model, path):
    from copy import copy

    saved, loaded = copy(model.gpc), Model.load(path).gpc
    h, labels = embeddings(model, 2), np.array(["pose", "noise"])
    assert saved.update(h, labels) == loaded.update(h, labels)
    np.testing.assert_allclose(loaded.attribute(h)[0], saved.attribute(h)[0], atol=1e-9)


def test_the_same_model_is_written_in_the_same_bytes(model, path, tmp_path):
    Model.load(path).save(tmp_path / "again.pt")
    assert (tmp_path / "again.pt").read_bytes() == path.read_bytes()


def test_a_file_that_holds_it_four_times_says_the_same_and_is_written_smaller(model, path, tmp_path):
    content = torch.load(path, weights_only=True)
    state = content["diagnoser"]["classifier"]
    assert len({gpc["labelled"].data_ptr() for gpc in (state["failure"], *state["causes"])}) == 1
    for gpc in content["diagnoser"]["classifier"]["causes"]:
        gpc["labelled"] = gpc["labelled"].clone()
    torch.save(content, tmp_path / "large.pt")
    assert (tmp_path / "large.pt").stat().st_size > path.stat().st_size
    Model.load(tmp_path / "large.pt").save(tmp_path / "small.pt")
    assert (tmp_path / "small.pt").read_bytes() == path.read_bytes()
    features = np.random.default_rng(1).normal(size=(4, len(model.diagnoser.error_weights) - 1))
    expected, actual = (
        made.classifier.judge(made.classifier.normalized(features))
        for made in (model.diagnoser, Model.load(tmp_path / "small.pt").diagnoser)
    )
    np.testing.assert_array_equal(actual.failure_N, expected.failure_N)
    np.testing.assert_array_equal(actual.causes_N_3, expected.causes_N_3)


def changed(**changes):
    def spoil(path):
        content = torch.load(path, weights_only=True)
        torch.save({name: value for name, value in (content | changes).items() if value is not None}, path)

    return spoil


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.unlink(), "no such model; make one with 'make results'"),
        (lambda path: os.truncate(path, 1000), "is damaged or not a model"),
        (lambda path: path.write_bytes(pickle.dumps(print, protocol=2)), "is damaged or not a model"),
        (lambda path: torch.save({"weights": torch.zeros(3)}, path), "is not a model"),
        (changed(version=3), "is a model of version 3, not 4; make one with"),
        (changed(version=7), "is a model of version 7, not 4; make one with"),
        (changed(gpc=None), "missing or damaged parts .*'gpc'"),
        (changed(encoder={}), "missing or damaged parts"),
    ],
)
def test_a_file_that_is_no_model_of_this_version_is_one_line(path, spoil, message):
    spoil(path)
    with pytest.raises(InputError, match=message) as caught:
        Model.load(path)
    assert str(path) in str(caught.value)


@pytest.fixture
def none_shipped(tmp_path, monkeypatch):
    """No model is named, and none comes with the package, whether or not this checkout has one."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("gpca.model.location.SHIPPED", tmp_path / "shipped.pt")


def test_the_best_model_of_the_workflow_is_taken(tmp_path, none_shipped):
    with pytest.raises(InputError, match=f"none in .*snakemake -j2 results/default/model.pt.*{VARIABLE}"):
        model_path(results=tmp_path)
    for run in ("smoke", "older", "mine", "default", "full"):
        (tmp_path / run).mkdir()
        (tmp_path / run / "model.pt").touch()
        os.utime(tmp_path / run / "model.pt", (1000 + (run == "mine"), 1000 + (run == "mine")))
    (tmp_path / "shipped.pt").touch()  # that of the package is taken where the workflow made none
    for run in ("full", "default", "mine", "older", "smoke"):
        assert model_path(results=tmp_path) == tmp_path / run / "model.pt"
        (tmp_path / run / "model.pt").unlink()
    assert model_path(results=tmp_path) == tmp_path / "shipped.pt"


def test_a_named_model_comes_before_those_below_the_working_directory(tmp_path, none_shipped, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"none in {tmp_path}/results; "):
        model_path()
    (tmp_path / "results/mine").mkdir(parents=True)
    (tmp_path / "results/mine/model.pt").touch()
    assert model_path().resolve() == tmp_path / "results/mine/model.pt"
    monkeypatch.setenv(VARIABLE, str(tmp_path / "lost.pt"))
    with pytest.raises(InputError, match=f"{VARIABLE}=.*lost.pt: no such model"):
        model_path(results=tmp_path)
    (tmp_path / "lost.pt").touch()
    assert model_path() == tmp_path / "lost.pt"
    assert model_path("other.pt").name == "other.pt"
