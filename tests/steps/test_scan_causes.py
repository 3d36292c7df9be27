"""The steps of causes on scans: what is measured on two scenes, and what explainers learn from."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import Causes, labels_of
from gpca.causes.descriptors import Descriptors
from gpca.causes.scans import GLOBAL, LADDER
from gpca.causes.settings import ScanSamples
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.jobs.job import Job
from gpca.reenactment.dataset import Reenactments
from gpca.scans.pair import Rung
from gpca.scans.scene import ScanPairs
from gpca.steps import diagnosis as diagnoses
from gpca.steps.scan_causes import diagnose, folds_of, measure, starts_of
from tests.scans.corner import corner_pair
from tests.steps.test_guarantee import write_measurements

LADDER_OF_THREE = (Rung(0, 0), Rung(10, 0.1), Rung(60, 0.9))
AXES = ("rooms", 100)


def named(pair, number):
    return replace(pair, source_name=f"scan{number}", target_name=f"scan{number + 1}")


def test_starts_are_rungs_without_the_perfect_one_global_poses_and_noise_in_turns():
    # Two scenes with a pair of little overlap and two of much.
    made = [
        named(corner_pair(shared, points=600, scene=scene), 10 * number)
        for scene in ("hall", "kitchen")
        for number, shared in enumerate((0.2, 0.8, 0.9))
    ]
    pairs = ScanPairs.of(made)
    settings = ScanSamples(ladder_starts=2, times=(1.0, 3.0))
    found = {"good": lambda pair: pair.T_target_source, "failing": lambda pair: None}
    starts = starts_of(pairs, *AXES, settings, LADDER_OF_THREE, found)
    assert len(starts) == 6 * (2 + 1 + 1)
    assert {start.init_from for start in starts if start.kind == LADDER} == {"10deg_0.1m", "60deg_0.9m"}
    assert {start.init_from for start in starts if start.kind == GLOBAL} == {"good"}
    noisy = [start for start in starts if start.times]
    assert [start.times for start in noisy] == [1.0, 3.0, 1.0, 3.0, 1.0, 3.0]
    natural = {(start.pair, start.init_from): start.T_target_source for start in starts if not start.times}
    assert all(np.array_equal(natural[start.pair, start.init_from], start.T_target_source) for start in noisy)


def job_in(folder):
    """Two scenes of two scans each, of which four fifths are on both."""
    for scene in ("hall", "kitchen"):
        pair = corner_pair(0.8)
        poses = np.stack([np.eye(4), pair.T_target_source])
        np.savez(folder / f"{scene}.npz", cloud_0=pair.target_M_3, cloud_1=pair.source_N_3, T_scene_cloud=poses)
    settings = {
        "samples": {"points": 96, "pairs": 1, "ladder_starts": 1, "global_start": False, "times": [3.0]},
        "entry": {"title": "Tiny rooms", "kind": "npz", "location": "tiny"},
        "role": "evaluation",
        "scans": {"strata": [0.1, 0.9], "scan_points": 6000, "ladder": [{"rotation_deg": 20.0, "translation_m": 0.2}]},
        "causes": {"starts": 13, "clean_pairs": 20},
        "descriptors": {"starts": 1, "restarts": 1, "icp_points": 64},
        "reenactment": {"hypotheses": 2},
    }
    files = {"scan_causes": "causes.npz", "samples": "causes.csv", "descriptors": "d.npz", "reenactments": "r.npz"}
    outputs = {name: folder / "out" / file for name, file in files.items()}
    data = [folder / "hall.npz", folder / "kitchen.npz"]
    return Job(settings=settings, source=AXES[0], seed=AXES[1], place=str(folder), data=data, **outputs)


def test_what_is_measured_described_and_re_enacted_is_of_the_same_samples(tmp_path):
    job = job_in(tmp_path)
    measure(job)
    causes = Causes.load(job.scan_causes, AXES)
    table = pd.read_csv(job.samples)
    assert len(causes) == len(table) == 2 * 2 and set(causes.registrations.split) == {"test"}
    assert set(causes.registrations.cluster) == {"hall", "kitchen"} == set(table["cluster"])
    assert table["times"].tolist() == [0.0, 3.0] * 2
    assert table.loc[table["times"] == 0, "phi_noise"].eq(0).all()
    Descriptors.load(job.descriptors, causes.registrations)
    enacted = Reenactments.load(job.reenactments, causes.registrations)
    assert np.isfinite(enacted.verdict).all()
    written = [job.scan_causes, job.samples, job.descriptors, job.reenactments]
    before = [path.read_bytes() for path in written]
    measure(job)
    assert [path.read_bytes() for path in written] == before


EXPLAINERS = {"chance": ["scans"], "pair_forest": ["objects", "scans"], "gate_rmse": ["scans"], "reenact": ["scans"]}
SETTINGS = {
    "samples": {"folds": 3},
    "explainers": EXPLAINERS,
    "settings": {"pair_forest": {"trees": 10}},
    "causes": {"starts": 13},
    "encoder": {"backbone": "dgcnn", "draw_points": 64},
}


@pytest.fixture(scope="module")
def diagnosis(causes, tmp_path_factory):
    """Its files: numbers of the test samples are made up, but for one that tells the nominal, which two scenes have."""
    folder, random = tmp_path_factory.mktemp("scans"), np.random.default_rng(0)
    objects = write_measurements(folder / "objects", causes, ("cups", 100), random)
    tested = causes.subset(causes.rows("test"))
    names = np.resize(np.repeat(["hall", "kitchen", "attic"], 2), len(tested))
    tested = replace(tested, registrations=replace(tested.registrations, cluster=names))
    scans = [write_measurements(folder / "scans", tested, (name, 100), random) for name in ("rooms", "things")]
    files = {"scan_causes": "causes", "scan_descriptors": "descriptors", "scan_reenactments": "reenactments"}
    given = {name: [paths[kind] for paths in scans] for name, kind in files.items()}
    training = {name: [objects[name]] for name in ("causes", "descriptors", "reenactments")}
    return Job(settings=SETTINGS, source="scans", seed=100, predictions=folder / "said.csv", **given, **training)


def test_every_explainer_is_asked_about_all_scans_wherever_it_learned(diagnosis, causes):
    diagnose(diagnosis)
    rows = read_predictions(diagnosis.predictions, labels=("scans", "learned", "explainer"))
    tested = len(causes.rows("test"))
    counts = rows.groupby(["learned", "explainer", "scans"]).size()
    assert set(counts) == {tested}
    assert {(learned, name) for learned, name, _ in counts.index} == {
        (learned, name) for name, places in EXPLAINERS.items() for learned in places
    }
    assert rows.loc[rows["explainer"] == "gate_rmse", "abstained"].all()
    forests = [
        each["score_nominal"].tolist() for _, each in rows[rows["explainer"] == "pair_forest"].groupby("learned")
    ]
    assert forests[0] != forests[1]
    before = diagnosis.predictions.read_bytes()
    diagnose(diagnosis)
    assert diagnosis.predictions.read_bytes() == before


def test_nothing_is_learned_from_the_scene_that_is_asked_about(diagnosis, monkeypatch):
    asked = []

    class Spy:
        def __init__(self, *_axes):
            pass

        def fit(self, registrations):
            self._known = set(registrations.cluster)
            assert BORDERLINE not in registrations.concept and NOMINAL in registrations.concept

        def explain(self, registrations):
            assert not self._known & set(registrations.cluster)
            assert (registrations.concept == "").all() and "causes" not in registrations.attached
            assert np.isnan(registrations.T_target_source_true).all()
            asked.append(len(registrations))
            return entry.make("scans", 100).explain(registrations)

    entry = diagnoses.explainer_entry("chance", diagnoses.CAUSES)
    monkeypatch.setattr(diagnoses, "explainer_entry", lambda *_: replace(entry, make=Spy))
    one = Job(**{**vars(diagnosis), "settings": SETTINGS | {"explainers": {"chance": ["scans"]}}})
    diagnose(one)
    assert len(asked) == 3
    assert sum(asked) == len(pd.read_csv(diagnosis.predictions))


def test_what_would_learn_a_single_label_is_left_out_and_named(diagnosis, causes, capsys, tmp_path):
    tested = causes.subset(causes.rows("test"))
    nominal = tested.subset(np.flatnonzero(labels_of(tested.truth) == NOMINAL))
    names = np.resize(["hall", "kitchen"], len(nominal))
    nominal = replace(nominal, registrations=replace(nominal.registrations, cluster=names))
    paths = write_measurements(tmp_path, nominal, ("rooms", 100), np.random.default_rng(0))
    files = {"scan_causes": "causes", "scan_descriptors": "descriptors", "scan_reenactments": "reenactments"}
    given = {name: [paths[kind]] for name, kind in files.items()}
    diagnose(Job(**{**vars(diagnosis), **given, "predictions": tmp_path / "said.csv"}))
    assert "'pair_forest', learned from scans, is left out: what it would learn from has fewer than two labels" in (
        capsys.readouterr().err
    )
    assert set(pd.read_csv(tmp_path / "said.csv")["explainer"]) == {"pair_forest"}  # as it learned from objects


def test_clusters_are_dealt_into_no_more_folds_than_there_are():
    cluster = np.array(["b", "a", "c", "a", "d"])
    assert folds_of(cluster, 2).tolist() == [1, 0, 0, 0, 1]
    assert len(set(folds_of(cluster, 10))) == 4
