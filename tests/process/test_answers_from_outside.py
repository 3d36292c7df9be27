"""What strategies, policies, encoders and kinds of sources from outside may not return: one line each."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.active_learning import acquisition
from gpca.active_learning.acquisition import Pool, Strategy, select
from gpca.causes.policy import TREATMENTS, Decision
from gpca.errors import InputError
from gpca.objects import source
from gpca.objects.surface import Surface
from gpca.recovery.loop import Loop

from ..hostile import refusal

CORNERS = np.eye(3)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([0, 1.5], "of type list"),
        (np.array([0.0, 1.0]), "has type float64"),
        (np.zeros((2, 1), int), "has shape 2×1"),
        (np.array([0, 9]), "returns rows that a pool of 9 has not"),
        (np.array([-1, 0]), "returns rows that a pool of 9 has not"),
    ],
)
def test_a_strategy_returns_rows_of_the_pool(monkeypatch, rows, words):
    monkeypatch.setitem(acquisition.STRATEGIES, "mine", Strategy("Mine", lambda *_: rows))
    pool = Pool(np.zeros((9, 2)), np.zeros((9, 3)), np.zeros(9), np.zeros((1, 2)), np.array(["pose"] * 9))
    with pytest.raises(InputError, match=f"strategy 'mine'.*{words}"):
        select("mine", pool, 2, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("decision", "words"),
    [
        ("denoise", "returns a str; make it return a Decision"),
        (Decision(np.zeros(3), "", ""), "make it return a Decision of texts"),
        (Decision("hammer", "", ""), "action 'hammer': unknown"),
        (Decision("denoise", "rust", ""), "concept 'rust': unknown"),
    ],
)
def test_a_policy_returns_a_decision_that_can_be_taken(decision, words):
    loop = SimpleNamespace(actions=("denoise",), means=SimpleNamespace(policy=SimpleNamespace(treatments=TREATMENTS)))
    with pytest.raises(InputError, match=f"recovery policy 'mine'.*{words}"):
        Loop._decision(loop, "mine", SimpleNamespace(decide=lambda *_: decision), None)


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        (CORNERS, "yields a ndarray"),
        (Surface(3, CORNERS, None), "make it yield a named Surface"),
        (Surface("a", CORNERS.tolist(), None), "vertices_m: is of type list"),
        (Surface("a", CORNERS[:, :2], None), "vertices_m: has shape 3×2"),
        (Surface("a", CORNERS, CORNERS), "faces: has type float64"),
        (Surface("a", CORNERS, np.array([[0, 1, 3]])), "faces of vertices beyond its 3"),
        (Surface("a", CORNERS, None, CORNERS[:2]), "normals: has shape 2×3"),
    ],
)
def test_a_source_yields_surfaces(tmp_path, monkeypatch, surface, words):
    monkeypatch.setattr(source, "_module_of", lambda _: SimpleNamespace(from_entry=lambda *_: [surface]))
    entry = {"title": "Mine", "kind": "mine", "origin": "local", "location": str(tmp_path)}
    with pytest.raises(InputError, match=f"source 'Mine'.*{words}"):
        list(source.surfaces(entry, tmp_path))


@pytest.mark.parametrize(
    ("variable", "entry", "config", "words"),
    [
        ("ENCODERS", "none.such:Net", {"encoders": {"dgcnn": {"backbone": "own"}}}, "there is no none.such:Net"),
        ("ENCODERS", "json", {"encoders": {"dgcnn": {"backbone": "own"}}}, "there is no json"),
        ("SOURCES", "none.such", {"sources": {"v": {"title": "V", "kind": "own"}}}, "none.such: cannot be imported"),
        ("SOURCES", "json", {"sources": {"v": {"title": "V", "kind": "own"}}}, "its module json has no from_entry"),
    ],
)
def test_a_module_that_a_plugin_names_is_there(tmp_path, variable, entry, config, words):
    (tmp_path / "mine.py").write_text(f"{variable} = {{'own': '{entry}'}}\n")
    (tmp_path / "mine.yaml").write_text(json.dumps({"plugins": ["mine.py"]} | config))
    refusal(["check-config", "mine.yaml"], tmp_path, words)


@pytest.mark.parametrize(
    ("size", "returned", "words"),
    [
        (0, "", "whose embedding_size is 0"),
        (4, "clouds[0]", r"returns torch.float32 of shape \[128, 3\]; return torch.float32 of shape \[12, 4\]"),
        (4, "clouds[:, 0, :1].repeat(1, 4).double()", "returns torch.float64"),
        (4, "clouds.numpy()", "returns a ndarray"),
        (4, "clouds.mean(dim=1)[:, [0, 0, 0, 0]] * torch.nan", "the loss is not finite|contains NaN"),
    ],
)
def test_an_encoder_returns_embeddings(registrations, monkeypatch, size, returned, words):
    import torch

    from gpca.encoders import registry
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import train_encoder

    class Mine(torch.nn.Linear):
        embedding_size = size

        def forward(self, clouds):
            return eval(returned, {"clouds": clouds, "torch": torch})

    monkeypatch.setitem(registry.ENCODERS, "mine", "mine:Mine")
    monkeypatch.setattr(registry, "load", lambda _: lambda: Mine(1, 1))
    with pytest.raises(InputError, match=words):
        train_encoder(registrations, "tiny", 0, EncoderSettings("mine", draw_points=128, epochs=1, batch_size=12))
