"""The examples of docs/adding.md, taken from that page and run; those that need the workflow: tests/workflow."""

import sys
from dataclasses import replace
from importlib import import_module, invalidate_caches
from pathlib import Path

import numpy as np
import pytest
import yaml
from snakemake.utils import update_config

from gpca.active_learning import acquisition
from gpca.config.check import check

from .config.configs import load
from .documents import block


@pytest.fixture
def config():
    """The embedded default, as Snakemake puts it together."""
    return load()


@pytest.fixture
def added_modules(tmp_path, monkeypatch):
    """Put an example's module beside its siblings without writing into the project."""
    names = []

    def add(file, containing=""):
        path = tmp_path / file
        path.parent.mkdir(parents=True)
        path.write_text(block(file, containing))
        package = import_module(".".join(Path(file).parent.parts))
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(path.parent)])
        invalidate_caches()
        names.append(".".join(Path(file).with_suffix("").parts))
        return import_module(names[-1])

    yield add
    for name in names:
        sys.modules.pop(name, None)


def test_a_dataset_by_an_entry(config, tmp_path):
    import trimesh

    from gpca.objects.source import surfaces

    (tmp_path / "my_parts").mkdir()
    trimesh.creation.box((40, 50, 60)).export(tmp_path / "my_parts" / "brick.stl")
    update_config(config, yaml.safe_load(block("config/sources.yaml", "my_parts")))
    entry = check(config | {"data_dir": str(tmp_path)})["my_parts"]
    assert entry["stand_in"] is False
    [surface] = surfaces(entry, tmp_path)
    assert surface.name == "brick"
    assert surface.vertices_m.max() == pytest.approx(0.03)


def test_an_explainer(config, added_modules, registrations, tmp_path):
    import pandas as pd

    from gpca.attribution.predictions import write_predictions
    from gpca.explainers.registry import explainer_entry

    added_modules("baselines/nearest_quality.py")
    update_config(config, yaml.safe_load(block("config/config.yaml", "nearest_quality")))
    check(config)
    explainer = explainer_entry("nearest_quality").make("tiny", 0, **config["explainers"]["nearest_quality"])
    explainer.fit(registrations.subset(registrations.rows("train")))
    attribution = explainer.explain(registrations.without_labels())
    np.testing.assert_allclose(attribution.scores_N_C.sum(axis=1), 1)
    write_predictions(tmp_path / "predictions.csv", registrations, attribution)
    rows = pd.read_csv(tmp_path / "predictions.csv")
    assert (rows["concept_predicted"] == rows["concept_true"]).mean() > 0.5  # chance is a third


def test_an_encoder(config, added_modules, registrations, monkeypatch):

    from gpca.encoders import registry
    from gpca.encoders.registry import EncoderSettings
    from gpca.encoders.training import embed, train_encoder

    added_modules("gpca/encoders/pointwise.py")
    monkeypatch.setattr(registry, "ENCODERS", dict(registry.ENCODERS))
    exec(block("gpca/encoders/registry.py", "pointwise"), {"ENCODERS": registry.ENCODERS})
    update_config(config, yaml.safe_load(block("config/config.yaml", "pointwise")))
    check(config)
    assert config["embedding"]["encoder"] in config["encoders"]
    settings = EncoderSettings(**config["encoders"]["pointwise"] | {"epochs": 1, "draw_points": 64})
    model, curve = train_encoder(registrations, "tiny", 0, settings)
    assert len(curve) == 1
    h_S_d, _ = embed(model, registrations, "tiny", 0, settings)
    assert h_S_d.shape == (len(registrations), 128)
    assert np.isfinite(h_S_d).all()


def test_an_acquisition_strategy(config, registrations, monkeypatch, tmp_path):
    from gpca.active_learning.curves import POOL_COLUMNS, collect_curves, write_curves
    from gpca.active_learning.rounds import initial_gpc, make_task, rounds
    from gpca.active_learning.settings import ActiveLearningSettings
    from gpca.classifier.settings import GPCSettings
    from gpca.declarations.plan import Run
    from gpca.experiments.active_learning import table3_extended

    monkeypatch.setitem(acquisition.STRATEGIES, "bald_dense", None)  # taken out again at the end
    exec(block("gpca/active_learning/acquisition.py"), dict(vars(acquisition)))
    update_config(config, yaml.safe_load(block("config/config.yaml", "bald_dense")))
    check(config)

    random = np.random.default_rng(0)
    concepts, concept_S = np.unique(registrations.concept, return_inverse=True)
    h_S_8 = (4 * random.normal(size=(len(concepts), 8)))[concept_S] + random.normal(size=(len(registrations), 8))
    gpc = GPCSettings(learning_rate=0.05, iterations=20, inducing=12, draws=100)
    settings = ActiveLearningSettings(initial=12, labels=8, batch=4, gpc=gpc)
    task = make_task(replace(registrations, attached={"embedding": h_S_8}), "overlap", settings, "tiny", 0)
    start = initial_gpc(task, settings, "tiny", 0)
    paths = []
    for name in config["active_learning"]["strategies"]:
        steps = [step for step, _ in rounds(task.project(start), start, name, settings, "tiny", 0)]
        assert [step["labels"] for step in steps] == [0, 4, 8]
        paths.append(tmp_path / f"tiny/{name}/seed0.csv")
        paths[-1].parent.mkdir(parents=True)
        write_curves(paths[-1], {("pretrained", "overlap"): steps}, POOL_COLUMNS)
    run = Run(config | {"sources": {"tiny": {"title": "Tiny", "stand_in": False}}})
    table = table3_extended(run, collect_curves(paths, 0.9), {("tiny", 0): 3})
    table.write(tmp_path / "table")
    assert (tmp_path / "table.md").read_text().count("| BALD, density-weighted |") == 1


def test_a_registration_method(config, added_modules, objects):
    from gpca.alignment.methods.interface import Pair
    from gpca.alignment.methods.registry import method_module, methods
    from gpca.alignment.pose_error import adds_error
    from gpca.rigid import exp, inverse, transform

    added_modules("gpca/alignment/methods/principal_axes.py")
    assert methods()["principal_axes"].title == "Principal axes"
    assert method_module("principal_axes") == "gpca.alignment.methods.principal_axes"
    update_config(config, yaml.safe_load(block("config/config.yaml", "principal_axes")))
    check(config)
    points = objects.points(0).astype(float) / objects.diameters_m[0]  # of a brick
    T_true = exp(np.array([[1.0, -2.0, 0.5, 0.3, 0.2, -0.4]]))[0]
    names = {"pair": Pair(transform(inverse(T_true), points[:300]), points[300:])}
    exec(block("align.py"), names)
    errors = [adds_error(names["pair"].source, names[name].T_target_source, T_true) for name in ("coarse", "fine")]
    assert errors[1] < errors[0] < 0.1
    assert names["fine"].converged


def test_an_estimator(config, added_modules, objects):
    from gpca.alignment.methods.interface import Pair
    from gpca.alignment.methods.registry import make_method
    from gpca.uncertainty.estimators.interface import RegisteredPair
    from gpca.uncertainty.estimators.registry import estimator_module, estimators

    added_modules("gpca/uncertainty/estimators/sensitivity.py")
    assert estimators()["sensitivity"].title == "First order in the start"
    assert estimator_module("sensitivity") == "gpca.uncertainty.estimators.sensitivity"
    update_config(config, yaml.safe_load(block("config/config.yaml", "sensitivity")))
    check(config)
    points = objects.points(0).astype(float) / objects.diameters_m[0]
    pair = Pair(points[:300], points[300:])
    registered = RegisteredPair(pair, make_method("point_to_point")(pair), "point_to_point", np.full(6, 0.03))
    names = {"registered": registered}
    exec(block("estimate.py"), names)
    steps = 0.25 * 0.03 * np.concatenate([np.eye(6), -np.eye(6)])
    expected = sum(np.outer(twist, twist) for twist in registered.twists_from(steps)) / (2 * 0.25**2)
    assert names["estimate"].covariance_6_6 == pytest.approx(expected)
    assert np.trace(expected) > 0


def test_a_recovery_action_passes_the_check(config, monkeypatch):
    from gpca.recovery import actions

    monkeypatch.setitem(actions.ACTIONS, "closer", None)
    exec(block("gpca/recovery/actions.py"), dict(vars(actions)))
    update_config(config, yaml.safe_load(block("config/config.yaml", "closer")))
    check(config)
    assert config["recovery"]["actions"].keys() == actions.ACTIONS.keys()
