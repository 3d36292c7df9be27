"""A run whose only samples are eight registrations of four objects, and what is shipped of it."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.attribution.predictions import write_predictions
from gpca.causes.dataset import LABELS, labels_of
from gpca.classifier.scores import Attribution
from gpca.tracks import published as module
from gpca.tracks.published import Published
from gpca.tracks.shipping import collect
from gpca.tracks.track import TRACKS

from ..config.configs import load
from ..documents import block

SOURCE, SEED = "four", 100


def knowing_scores(causes):
    """Scores that name every label rightly; borderline is called nominal."""
    label_S = labels_of(causes.truth)
    scores_S_4 = 0.05 + 0.85 * (label_S[:, None] == np.array(LABELS))
    scores_S_4[~np.isin(label_S, LABELS), 0] = 0.9
    return scores_S_4


@pytest.fixture(scope="session")
def run(causes, tmp_path_factory):
    """The folder of a run with the predictions of two explainers: `rule` knows the truth, `chance` always says pose."""
    folder = tmp_path_factory.mktemp("run")
    named = replace(causes, registrations=replace(causes.registrations, axes=(SOURCE, SEED)))
    named.save(folder / f"causes/{SOURCE}/seed{SEED}.npz")
    pose_S_4 = np.tile([0.1, 0.1, 0.7, 0.1], (len(causes), 1))
    for name, scores_S_4 in {"chance": pose_S_4, "rule": knowing_scores(causes)}.items():
        path = folder / f"diagnoses/{SOURCE}/{name}/seed{SEED}.csv"
        write_predictions(path, causes.registrations, Attribution.of_scores(LABELS, scores_S_4, seconds=0.0))
    return folder


@pytest.fixture(scope="session")
def config():
    """The default config, of that run."""
    whole = load()
    whole["diagnosis"]["explainers"] = {"chance": None, "rule": None}
    return whole | {"sources": {SOURCE: {}}, "seeds": [SEED]}


@pytest.fixture(scope="session")
def shipped(run, config):
    """What is shipped of the track `causes`."""
    return collect(TRACKS["causes"], run, config)


@pytest.fixture
def published(shipped, tmp_path, monkeypatch):
    """The same, where the commands find it."""
    monkeypatch.setattr(module, "FOLDER", tmp_path / "published")
    shipped.save(tmp_path / "published/causes.npz")
    return Published.load(TRACKS["causes"])


@pytest.fixture
def method(tmp_path, monkeypatch, apart):
    """The method of docs/adding.md, in a file of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_method.py").write_text(block("my_method.py", page="docs/adding.md"))
    return "my_method.py"
