import os
import pickle
import zipfile

import numpy as np
import pytest
import torch

from gpca.errors import InputError
from gpca.io.array_tree import read_tree, write_tree
from gpca.model.file import FEATURE_COUNT, Model
from gpca.model.location import VARIABLE, model_path
from gpca.model.result import Evidence

from .conftest import in_version_4


@pytest.fixture
def path(model, tmp_path):
    model.save(tmp_path / "model.pt")
    return tmp_path / "model.pt"


def embeddings(model, n=5):
    return np.random.default_rng(0).normal(size=(n, len(model.gpc._scaler.mean_d))).astype(np.float32)


def test_a_loaded_model_says_the_same(model, path):
    loaded = Model.load(path)
    cloud = np.random.default_rng(0).random((1, 64, 3))
    np.testing.assert_array_equal(loaded.encoder(cloud), model.encoder(cloud))
    np.testing.assert_allclose(loaded.encoder(cloud, "cpu:0"), model.encoder(cloud), atol=1e-6)
    h = embeddings(model)
    for expected, actual in zip(model.gpc.attribute(h), loaded.gpc.attribute(h), strict=True):
        np.testing.assert_array_equal(actual, expected)
    assert loaded.encoder.settings == model.encoder.settings
    for name in ("icp", "cloud_points", "policy", "title", "stand_in", "familiar"):
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
    content = read_tree(path)
    state = content["diagnoser"]["classifier"]
    assert len({id(gpc["labelled"]) for gpc in (state["failure"], *state["causes"])}) == 1
    for gpc in content["diagnoser"]["classifier"]["causes"]:
        gpc["labelled"] = gpc["labelled"].copy()
    write_tree(tmp_path / "large.pt", content)
    assert (tmp_path / "large.pt").stat().st_size > path.stat().st_size
    Model.load(tmp_path / "large.pt").save(tmp_path / "small.pt")
    assert (tmp_path / "small.pt").read_bytes() == path.read_bytes()
    require_same_judgment(Model.load(tmp_path / "small.pt"), model)


def require_same_judgment(one, other, tolerance=0.0):
    features = np.random.default_rng(1).normal(size=(4, FEATURE_COUNT))
    actual, expected = (
        made.classifier.judge(made.classifier.normalized(features)) for made in (one.diagnoser, other.diagnoser)
    )
    np.testing.assert_allclose(actual.failure_N, expected.failure_N, rtol=0, atol=tolerance)
    np.testing.assert_allclose(actual.causes_N_3, expected.causes_N_3, rtol=0, atol=tolerance)


def test_a_file_that_torch_wrote_is_the_same_model(model, path, tmp_path):
    torch.save(in_version_4(before_6(read_tree(path))), tmp_path / "older.pt")
    older, features = Model.load(tmp_path / "older.pt"), embeddings(model)
    cloud = np.random.default_rng(0).random((2, 64, 3))
    np.testing.assert_array_equal(older.encoder(cloud), model.encoder(cloud))
    for expected, actual in zip(model.gpc.attribute(features), older.gpc.attribute(features), strict=True):
        np.testing.assert_allclose(actual, expected, atol=1e-6)
    require_same_judgment(older, model, 1e-6)
    classifiers = [made.diagnoser.classifier for made in (older, model)]
    assert classifiers[0].usual_distance == classifiers[1].usual_distance
    older.save(tmp_path / "newer.pt")
    names, newer = (zipfile.ZipFile(each).namelist() for each in (path, tmp_path / "newer.pt"))
    assert set(newer) == {name for name in names if "judge/trees" not in name}  # an untrained judge has none


def before_6(content):
    """Return the content of a model that tells no result from its start."""
    diagnoser = dict(content["diagnoser"])
    [guarantee, *_] = [level["guarantee"] for level in diagnoser.pop("levels")]
    del diagnoser["judge"]
    diagnoser |= {"threshold": diagnoser.pop("start_threshold"), "guarantee": guarantee}
    return content | {"version": 5, "diagnoser": diagnoser | {"error_weights": np.zeros(FEATURE_COUNT + 1)}}


def test_a_model_that_tells_no_result_from_its_start_says_the_weight_of_other_poses_and_promises_nothing(
    model, path, tmp_path
):
    write_tree(tmp_path / "older.pt", before_6(read_tree(path)))
    older = Model.load(tmp_path / "older.pt").diagnoser
    assert older.start_threshold == model.diagnoser.start_threshold
    evidence = Evidence(np.array([[0.01, 0.2]]), np.array([[0.7, 0.3]]), np.array([0.02]), np.array([0.9]))
    assert older.judge.probability(evidence, 0.03) == pytest.approx(evidence.apart(0.03))
    assert older.judge.error(evidence) == pytest.approx(0.067)
    assert [(level.threshold, level.guarantee) for level in older.levels] == [(0.5, None)]
    assert older.quick().at_default.threshold == 0.5
    Model.load(tmp_path / "older.pt").save(tmp_path / "newer.pt")
    assert read_tree(tmp_path / "newer.pt")["version"] == 6


def changed(**changes):
    def spoil(path):
        content = read_tree(path)
        write_tree(path, {name: value for name, value in (content | changes).items() if value is not None})

    return spoil


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: path.unlink(), "no such model; make one with 'make results'"),
        (lambda path: os.truncate(path, 1000), "is damaged or not a model"),
        (lambda path: path.write_bytes(pickle.dumps(print, protocol=2)), "is damaged or not a model"),
        (lambda path: torch.save({"weights": torch.zeros(3)}, path), "is not a model"),
        (changed(version=3), "is a model of version 3, not 6; make one with"),
        (changed(version=7), "is a model of version 7, not 6; make one with"),
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
    (tmp_path / "shipped.pt").touch()  # that of the package is taken where the workflow made none but the smallest
    runs = [f"{run}/model.pt" for run in ("full", "default", "mine", "older")]
    for name in (*runs, "shipped.pt", "smoke/model.pt"):
        assert model_path(results=tmp_path) == tmp_path / name
        (tmp_path / name).unlink()


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
