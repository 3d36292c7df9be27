import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.alignment.methods import registry
from gpca.alignment.methods.interface import MethodEntry, Outcome, Pair
from gpca.alignment.pose_error import pose_error
from gpca.errors import InputError
from gpca.rigid import require_rigid
from tests.documents import ROOT

from .pairs import POOR, clouds, error, perturbed, small_motion

OPTIONAL = {"cpd": "pycpd", "gicp_small": "small_gicp", "kiss_matcher": "kiss_matcher"}
RUNNING = sorted(set(registry.methods()) - set(registry.left_out(registry.methods())))
LOCAL = [name for name in RUNNING if not registry.method_entry(name).is_global]
GLOBAL = [name for name in RUNNING if registry.method_entry(name).is_global]
SEARCHING = {name for name in RUNNING if registry.method_module(name) in registry.REENACTMENT}  # from many starts
WITHOUT_NORMALS = {"point_to_point", "point_to_point_open3d", "trimmed", *OPTIONAL, *SEARCHING}


def test_every_method_is_found_and_has_a_title_of_its_own():
    entries = registry.methods()
    assert {name: entry.package for name, entry in entries.items() if entry.package} == OPTIONAL
    assert len({entry.title for entry in entries.values()}) == len(entries)
    for name, entry in entries.items():
        assert name in vars(import_module(registry.method_module(name)))["METHODS"]
        assert registry.method_entry(name) is entry


@pytest.mark.parametrize("name", LOCAL)
@pytest.mark.parametrize("seed", [0, 1])
def test_a_local_method_aligns_what_lies_close(objects, name, seed):
    pair, T_true = small_motion(objects, seed=seed)
    outcome = registry.make_method(name)(pair)
    assert outcome.failure == "" and outcome.fitness > 0.9
    require_rigid(outcome.T_target_source, name)
    half_turn = name in SEARCHING  # may be taken: the objects are symmetric
    before, after = (pose_error(pair.source, T, T_true, half_turn) for T in (np.eye(4), outcome.T_target_source))
    assert after < 0.04 and after < before


@pytest.mark.parametrize("name", GLOBAL)
def test_a_global_method_needs_no_initial_pose(objects, name):
    pair, T_true = perturbed(objects, 1, "pose", seed=2)
    half_turn = np.diag([1.0, -1.0, -1.0, 1.0])
    outcomes = [registry.make_method(name)(pair.started_at(start)) for start in (np.eye(4), half_turn)]
    assert error(pair, outcomes[0], T_true) < 0.1
    assert np.array_equal(outcomes[0].T_target_source, outcomes[1].T_target_source)


@pytest.mark.parametrize("name", RUNNING)
def test_what_is_given_is_not_changed_and_a_repetition_is_the_same(objects, name):
    pair, _ = perturbed(objects, 1, "overlap")
    names = ("source", "target", "T_target_source_init", "source_normals", "target_normals")
    before = [getattr(pair, part).copy() for part in names]
    method = registry.make_method(name)
    first, second = method(pair), method(pair)
    assert first.T_target_source.tobytes() == second.T_target_source.tobytes()
    first.T_target_source[:] = 0  # what is returned is no view of what was given
    for part, expected in zip(names, before, strict=True):
        assert np.array_equal(getattr(pair, part), expected)


def test_two_threads_change_no_bit():
    """This process has one thread."""
    environment = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "2")
    command = [sys.executable, "-m", "tests.alignment.methods.test_registry"]
    run = subprocess.run(command, cwd=ROOT, env=os.environ | environment, stdout=subprocess.PIPE, text=True, check=True)
    one, two = list(digests()), run.stdout.splitlines()
    assert [line.split()[0] for line in one] == RUNNING
    assert one == two


@pytest.mark.parametrize("name", [name for name in RUNNING if name not in WITHOUT_NORMALS])
def test_without_normals_a_registration_fails(objects, name):
    source, target, _, _ = clouds(objects, 0)
    start = np.eye(4)
    start[0, 3] = 0.01
    outcome = registry.make_method(name)(Pair(source, target, start))
    assert "has no normals" in outcome.failure
    assert not outcome.converged and outcome.fitness == 0
    assert np.array_equal(outcome.T_target_source, start)


@pytest.mark.parametrize("name", sorted({*LOCAL} - {"cpd", "trimmed"} - SEARCHING))  # which go any distance
def test_without_correspondences_a_registration_fails(objects, name):
    pair, _ = small_motion(objects)
    far = np.eye(4)
    far[2, 3] = 5
    outcome = registry.make_method(name)(pair.started_at(far))
    assert "within 0.1 diameters" in outcome.failure or "correspondences are left" in outcome.failure
    assert np.array_equal(outcome.T_target_source, far)


@pytest.mark.parametrize("name", sorted({*LOCAL} - SEARCHING))
def test_a_method_that_is_still_on_its_way_has_failed(objects, name):
    pair, _ = perturbed(objects, 2, "pose", seed=0)
    outcome = registry.make_method(name, {"max_iterations": 1})(pair)
    assert outcome.failure == "has not converged in 1 iterations"
    assert not np.array_equal(outcome.T_target_source, np.eye(4))


@pytest.mark.parametrize("poor", POOR)
@pytest.mark.parametrize("name", RUNNING)
def test_poor_clouds_give_a_rigid_pose_and_no_exception(objects, name, poor):
    source, target, _, _ = clouds(objects, 0)
    pair = Pair(POOR[poor](source), POOR[poor](target)).with_normals()
    outcome = registry.make_method(name)(pair)
    require_rigid(outcome.T_target_source, name)
    assert 0 <= outcome.fitness <= 1 and np.isfinite(outcome.inlier_rmse)


def test_a_pose_that_is_not_finite_is_a_failure(objects, monkeypatch):
    pair, T_true = small_motion(objects)
    broken = MethodEntry("Broken", lambda pair: replace(Outcome.at(pair, T_true, 0.1), T_target_source=T_true * np.nan))
    monkeypatch.setattr(registry.REGISTRY, "by_module", lambda: {"broken": {"broken": broken}})
    outcome = registry.make_method("broken")(pair)
    assert outcome.failure == "the pose is not finite"
    assert np.array_equal(outcome.T_target_source, np.eye(4))


def test_a_missing_package_is_named(monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda name: None)
    assert registry.left_out(["point_to_point", *OPTIONAL]) == OPTIONAL
    for name, package in OPTIONAL.items():
        with pytest.raises(InputError, match=f"'{name}': needs the package {package}; install it or leave"):
            registry.make_method(name)


@pytest.mark.parametrize(
    ("name", "settings", "words"),
    [
        ("icp2", {}, "'icp2': unknown; choose one of point_to_point, .*trimmed"),
        ("gicp", {"voxel": 0.1}, "setting voxel: unknown"),
        ("gicp", {"max_iterations": 2.5}, "max_iterations: 2.5 should be a valid integer"),
        ("teaser", {"noise": float("nan")}, "noise: nan should be a finite number"),
        ("trimmed", {"overlap": -0.5}, "overlap: -0.5 should be greater than or equal to"),
        ("trimmed", {"overlap": 5}, "overlap: 5 should be less than or equal to 1"),
        ("huber", {"correspondence_distance": "wide"}, "correspondence_distance: 'wide' should be a valid number"),
        ("tukey", {"kernel": "HuberLoss"}, "setting kernel: unknown"),
    ],
)
def test_settings_that_a_method_does_not_take_are_refused(name, settings, words):
    with pytest.raises(InputError, match=words):
        registry.require_settings(name, settings)


class Refusing:
    """KISS-Matcher where it refuses every voxel but the one by which its threads are limited."""

    KISSMatcherConfig = staticmethod(lambda voxel: voxel)

    def KISSMatcher(self, voxel):
        if voxel != 1.0:
            raise RuntimeError("Too small voxel size")
        return SimpleNamespace(estimate=lambda source, target: None)


@pytest.mark.parametrize("voxel", [0.1, 0.0, 0.001, 2.0])
def test_kiss_matcher_fails_where_it_refuses_and_is_not_asked_where_it_would_end_the_process(
    objects, monkeypatch, voxel
):
    monkeypatch.setitem(sys.modules, "kiss_matcher", Refusing())
    monkeypatch.setattr(registry, "find_spec", lambda name: True)
    outcome = registry.make_method("kiss_matcher", {"voxel": voxel})(small_motion(objects)[0])
    few = f"of the source, voxels of {voxel:g} diameters leave too few points"
    assert outcome.failure == ("KISS-Matcher: Too small voxel size" if voxel == 0.1 else few)


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one processor: no thread could be started")
def test_kiss_matcher_starts_no_thread_since_its_threads_would_race():
    pytest.importorskip("kiss_matcher")
    code = """
import os
import numpy as np
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.matching import align_by_kiss_matcher as align
from gpca.process.processor import prepare

prepare()
points = np.random.default_rng(0).normal(size=(2000, 3))
points *= np.array([0.5, 0.3, 0.2]) / np.linalg.norm(points, axis=1, keepdims=True)
allowed, threads = os.sched_getaffinity(0), os.listdir("/proc/self/task")
align(Pair(points[:1000], points[1000:]), 0.05)
assert os.sched_getaffinity(0) == allowed
print(len(os.listdir("/proc/self/task")) - len(threads))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "0"


def digests():
    """A line on the outcome of every method on one pair of points on an ellipsoid."""
    random = np.random.default_rng(0)
    points = random.normal(size=(2, 400, 3))
    points *= np.array([0.5, 0.3, 0.2]) / np.linalg.norm(points, axis=-1, keepdims=True)
    pair = Pair(points[0] + random.normal(scale=0.01, size=(400, 3)) + [0.03, -0.02, 0.01], points[1], seed=3)
    for name in RUNNING:
        outcome = registry.make_method(name)(pair.with_normals())
        told = outcome.T_target_source.tobytes() + np.array([outcome.fitness, outcome.inlier_rmse]).tobytes()
        yield f"{name} {hashlib.sha256(told).hexdigest()} {outcome.failure}".rstrip()


if __name__ == "__main__":
    print(*digests(), sep="\n")
