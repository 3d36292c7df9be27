from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.methods import registry
from gpca.alignment.methods.interface import FailedRegistration, MethodEntry, Outcome
from gpca.alignment.methods.registry import make_method
from gpca.errors import InputError
from gpca.steps.registration_trials import PairSettings, pair_to_register, try_methods

SETTINGS = PairSettings(samples=6, points=100, global_start="fgr")
METHODS = {"point_to_point": {}, "fgr": {}, "point_to_plane": {"max_iterations": 1}}


def tried(registrations, objects, methods=METHODS, **changes):
    return try_methods(registrations, objects, "tiny", 100, methods, replace(SETTINGS, **changes))


@pytest.fixture(scope="module")
def rows(registrations, objects):
    return tried(registrations, objects)


def test_local_methods_start_twice_and_global_ones_once(rows):
    assert list(rows) == list(METHODS)
    for name, starts in {"point_to_point": ["initial", "fgr"], "fgr": ["none"]}.items():
        assert rows[name]["start"].tolist() == starts * 6
        assert rows[name]["sample"].tolist() == np.repeat(range(6), len(starts)).tolist()
    assert sorted(rows["fgr"]["concept"]) == ["noise"] * 2 + ["overlap"] * 2 + ["pose"] * 2


def test_a_row_is_what_the_method_found_on_that_pair(rows, registrations):
    row = registrations.rows("test")[1]
    pair = pair_to_register(registrations, row, "tiny", 100, 100)
    coarse = make_method("fgr")(pair)
    fine = make_method("point_to_point")(pair.started_at(coarse.T_target_source))
    for name, outcome in (("fgr", coarse), ("point_to_point", fine)):
        of_name = rows[name]
        found = of_name[(of_name["sample"] == 1) & (of_name["start"] != "initial")].iloc[0]
        assert (found["fitness"], found["inlier_rmse"]) == (outcome.fitness, outcome.inlier_rmse)
        assert found["object"] == registrations.object_name[row]
        assert found["severity_noise"] == registrations.severity_noise[row]
    assert (rows["point_to_point"]["seconds"] > 0).all()


def test_a_method_can_have_more_points_than_the_others(rows, registrations, objects):
    tried_with = tried(registrations, objects, points_of={"fgr": 200}, neighbors_of={"fgr": 40})
    assert tried_with["point_to_point"]["points"].tolist() == rows["point_to_point"]["points"].tolist()
    assert rows["fgr"]["points"].max() == 100 and tried_with["fgr"]["points"].max() == 200
    first = [rows["point_to_point"]["fitness"][::2].tolist(), tried_with["point_to_point"]["fitness"][::2].tolist()]
    assert first[0] == first[1]  # from its own start, a local method sees what it saw before
    row = registrations.rows("test")[1]
    pairs = [pair_to_register(registrations, row, "tiny", 100, *of) for of in ((200, 40), (100,))]
    coarse = make_method("fgr")(pairs[0])
    fine = make_method("point_to_point")(pairs[1].started_at(coarse.T_target_source))
    second = tried_with["point_to_point"].iloc[3]
    assert (second["sample"], second["start"]) == (1, "fgr") and second["fitness"] == fine.fitness
    assert set(map(tuple, pairs[1].source)) <= set(map(tuple, pairs[0].source))


def test_a_method_that_was_stopped_says_so(rows):
    stopped = rows["point_to_plane"]
    assert (stopped["failure"] == "has not converged in 1 iterations").any()


def test_the_true_pose_is_the_initial_one_but_for_pose_errors(registrations, objects, monkeypatch):
    still = MethodEntry("Still", lambda pair: Outcome.at(pair, pair.T_target_source_init, 0.1))
    monkeypatch.setattr(registry.REGISTRY, "by_module", lambda: {"m": {"still": still, "blind": BLIND}})
    rows = tried(registrations, objects, {"still": {}, "blind": {}}, global_start="blind")["still"]
    first = rows[rows["start"] == "initial"]
    off = first["concept"] == "pose"
    assert (first[~off][["add_relative", "rotation_error_rad", "translation_error"]] < 1e-6).all(axis=None)
    np.testing.assert_allclose(first[off]["translation_error"], first[off]["severity_translation"], atol=0.02)
    assert (first[~off]["failure"] == "").all() and (first[off]["add_relative"] > 0.02).all()


def no_match(pair):
    raise FailedRegistration("no match")


BLIND = MethodEntry("Blind", no_match, is_global=True)


def test_what_starts_at_a_failure_fails_with_its_reason(registrations, objects, monkeypatch):
    local = registry.method_entry("point_to_point")
    monkeypatch.setattr(registry.REGISTRY, "by_module", lambda: {"m": {"blind": BLIND, "point_to_point": local}})
    rows = tried(registrations, objects, {"point_to_point": {}, "blind": {}}, global_start="blind")
    assert set(rows["blind"]["failure"]) == {"no match"}
    second = rows["point_to_point"][rows["point_to_point"]["start"] == "blind"]
    assert len(second) == 6
    assert set(second["failure"]) == {"blind: no match"}
    assert (second["fitness"] == 0).all()


def test_clouds_are_thinned_and_have_normals(registrations):
    row = registrations.rows("test")[0]
    pair = pair_to_register(registrations, row, "tiny", 100, 70)
    assert len(pair.source) == len(pair.target) == len(pair.source_normals) == 70
    nearest = np.abs(registrations.source(row)[:, None] - pair.source).sum(axis=2).min(axis=0)
    assert nearest.max() == 0


@pytest.mark.parametrize(
    ("methods", "changes", "message"),
    [
        ({"gicp": {}}, {}, "method_pairs.global_start: 'fgr' is not among the methods"),
        ({"gicp": {}}, {"global_start": "gicp"}, "'gicp': needs an initial pose; choose one of .*fgr, "),
        ({"icp": {}, "fgr": {}}, {}, "'icp': unknown"),
        ({"fgr": {"radius": 1}}, {}, "setting radius: unknown; did you mean feature_radius"),
    ],
)
def test_methods_that_cannot_run_are_refused(registrations, objects, methods, changes, message):
    with pytest.raises(InputError, match=message):
        tried(registrations, objects, methods, **changes)
