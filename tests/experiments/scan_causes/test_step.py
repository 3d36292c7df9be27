"""The step on two scenes: which pairs and starts are measured, and that the same files are written again."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.causes.dataset import Causes
from gpca.causes.descriptors import Descriptors
from gpca.causes.scans import GLOBAL, LADDER
from gpca.experiments.scan_causes import step
from gpca.experiments.scan_causes.samples import starts_of
from gpca.experiments.scan_causes.settings import ScanSamples
from gpca.process.job import Job
from gpca.reenactment.dataset import Reenactments
from gpca.scans.pair import Rung
from gpca.scans.scene import ScanPairs
from tests.scans.corner import corner_pair

LADDER_OF_THREE = (Rung(0, 0), Rung(10, 0.1), Rung(60, 0.9))
AXES = ("rooms", 100)


def named(pair, number):
    return replace(pair, source_name=f"scan{number}", target_name=f"scan{number + 1}")


@pytest.fixture(scope="module")
def pairs():
    """Two scenes with a pair of little overlap and two of much."""
    made = [
        named(corner_pair(shared, points=600, scene=scene), 10 * number)
        for scene in ("hall", "kitchen")
        for number, shared in enumerate((0.2, 0.8, 0.9))
    ]
    return ScanPairs.of(made)


def test_starts_are_rungs_without_the_perfect_one_global_poses_and_noise_in_turns(pairs):
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
    step.run(job)
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
    step.run(job)
    assert [path.read_bytes() for path in written] == before


def test_the_global_method_starts_where_it_ends_and_not_where_it_fails(pairs):
    settings = step.TrialSettings(points=200, global_start="fgr")
    [(name, register)] = step.global_methods(settings, {"fgr": {}}, *AXES).items()
    assert name == "fgr" and register(pairs[2]).shape == (4, 4)
