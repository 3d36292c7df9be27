"""Who learns from what, on two data sets of scans that stand in for measured ones, and one source of objects."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import labels_of
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.experiments.scan_causes import diagnosis_step
from gpca.experiments.scan_causes.diagnosis_step import folds_of
from gpca.process.job import Job
from tests.steps.test_guarantee import write_measurements

EXPLAINERS = {"chance": ["scans"], "pair_forest": ["objects", "scans"], "gate_rmse": ["scans"], "reenact": ["scans"]}
SETTINGS = {
    "samples": {"folds": 3},
    "explainers": EXPLAINERS,
    "settings": {"pair_forest": {"trees": 10}},
    "causes": {"starts": 13},
    "encoder": {"backbone": "dgcnn", "draw_points": 64},
}


@pytest.fixture(scope="module")
def job(causes, tmp_path_factory):
    """Its files: numbers of the test samples are made up, but for one that tells the nominal."""
    folder, random = tmp_path_factory.mktemp("scans"), np.random.default_rng(0)
    objects = write_measurements(folder / "objects", causes, ("cups", 100), random)
    tested = causes.subset(causes.rows("test"))
    names = np.resize(["hall", "kitchen", "attic"], len(tested))
    tested = replace(tested, registrations=replace(tested.registrations, cluster=names))
    scans = [write_measurements(folder / "scans", tested, (name, 100), random) for name in ("rooms", "things")]
    files = {"scan_causes": "causes", "scan_descriptors": "descriptors", "scan_reenactments": "reenactments"}
    given = {name: [paths[kind] for paths in scans] for name, kind in files.items()}
    lessons = {name: [objects[name]] for name in ("causes", "descriptors", "reenactments")}
    return Job(settings=SETTINGS, source="scans", seed=100, predictions=folder / "said.csv", **given, **lessons)


def test_every_explainer_is_asked_about_all_scans_wherever_it_learned(job, causes):
    diagnosis_step.run(job)
    said = read_predictions(job.predictions, labels=("scans", "learned", "explainer"))
    tested = len(causes.rows("test"))
    counts = said.groupby(["learned", "explainer", "scans"]).size()
    assert set(counts) == {tested}
    assert {(learned, name) for learned, name, _ in counts.index} == {
        (learned, name) for name, places in EXPLAINERS.items() for learned in places
    }
    assert said.loc[said["explainer"] == "gate_rmse", "abstained"].all()
    forests = [
        rows["score_nominal"].tolist() for _, rows in said[said["explainer"] == "pair_forest"].groupby("learned")
    ]
    assert forests[0] != forests[1]
    before = job.predictions.read_bytes()
    diagnosis_step.run(job)
    assert job.predictions.read_bytes() == before


def test_nothing_is_learned_from_the_scene_that_is_asked_about(job, monkeypatch):
    asked = []

    class Spy:
        def __init__(self, *_axes):
            pass

        def fit(self, registrations):
            self._known = set(registrations.cluster)
            assert BORDERLINE not in registrations.concept and NOMINAL in registrations.concept

        def explain(self, registrations):
            from baselines.untrained import CauseChance

            assert not self._known & set(registrations.cluster)
            assert (registrations.concept == "").all() and "causes" not in registrations.attached
            assert np.isnan(registrations.T_target_source_true).all()
            asked.append(len(registrations))
            return CauseChance("scans", 100).explain(registrations)

    entry = diagnosis_step.explainer_entry("chance", diagnosis_step.CAUSES)
    monkeypatch.setattr(diagnosis_step, "explainer_entry", lambda *_: replace(entry, make=Spy))
    one = Job(**{**vars(job), "settings": SETTINGS | {"explainers": {"chance": ["scans"]}}})
    diagnosis_step.run(one)
    assert len(asked) == 3
    assert sum(asked) == len(pd.read_csv(job.predictions))


def test_what_would_learn_a_single_label_is_left_out_and_named(job, causes, capsys, tmp_path):
    tested = causes.subset(causes.rows("test"))
    nominal = tested.subset(np.flatnonzero(labels_of(tested.truth) == NOMINAL))
    names = np.resize(["hall", "kitchen"], len(nominal))
    nominal = replace(nominal, registrations=replace(nominal.registrations, cluster=names))
    paths = write_measurements(tmp_path, nominal, ("rooms", 100), np.random.default_rng(0))
    files = {"scan_causes": "causes", "scan_descriptors": "descriptors", "scan_reenactments": "reenactments"}
    given = {name: [paths[kind]] for name, kind in files.items()}
    diagnosis_step.run(Job(**{**vars(job), **given, "predictions": tmp_path / "said.csv"}))
    assert "'pair_forest', learned from scans, is left out: what it would learn from has fewer than two labels" in (
        capsys.readouterr().err
    )
    assert set(pd.read_csv(tmp_path / "said.csv")["explainer"]) == {"pair_forest"}  # as it learned from objects


def test_clusters_are_dealt_into_no_more_folds_than_there_are():
    cluster = np.array(["b", "a", "c", "a", "d"])
    assert folds_of(cluster, 2).tolist() == [1, 0, 0, 0, 1]
    assert len(set(folds_of(cluster, 10))) == 4
