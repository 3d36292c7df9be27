"""Scans explained without a model: a room that was seen from two places."""

import json
from itertools import combinations

import numpy as np
import pytest
import trimesh

from gpca import explain_scans
from gpca.__main__ import main
from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import clipped_cost
from gpca.alignment.pose_error import displacements
from gpca.errors import InputError
from gpca.model import scan_explainer
from gpca.model.clouds import read_points
from gpca.model.explanation import GIVEN, NOT_SURE
from gpca.model.page import length
from gpca.model.scan_explainer import BAD, GOOD, LEAST_OVERLAP, Evidence, failure_of, state_of
from gpca.model.scan_registration import COARSE_TO_FINE, Scans, VoxelICP, in_voxels, voxel_size
from gpca.process.environment import open3d_cloud
from gpca.rigid import exp, inverse, transform


def room(seed, low, high, size=12.0):
    """Points on two walls, the floor and two boxes of a room, where x lies between two shares of its size."""
    random = np.random.default_rng(seed)
    parts = []
    for center, extent in (
        ((0.5, 0.5, 0.0), (1, 1, 0)), ((0.5, 0.0, 0.15), (1, 0, 0.3)), ((0.0, 0.5, 0.15), (0, 1, 0.3)),
        ((0.35, 0.4, 0.1), (0.2, 0.1, 0.2)), ((0.6, 0.7, 0.06), (0.1, 0.25, 0.12)),
    ):  # fmt: skip
        unit = random.uniform(-0.5, 0.5, (2500, 3))
        if min(extent) > 0:  # on the sides of a box
            side = random.integers(0, 3, 2500)
            unit[np.arange(2500), side] = np.sign(unit[np.arange(2500), side]) / 2
        parts.append(np.array(center) + unit * extent)
    points = np.concatenate(parts)
    points = points[(points[:, 0] >= low) & (points[:, 0] <= high)]
    return size * points + random.normal(scale=0.002, size=points.shape)


TRUE = exp(np.array([[0.02, -0.03, 0.05, 0.2, -0.1, 0.05]]))[0]


@pytest.fixture(scope="module")
def scans():
    """A source and a target that share 60 % of a room of 12 m, beyond what an object may measure."""
    return transform(inverse(TRUE), room(0, 0.0, 0.8)), room(1, 0.2, 1.0)


@pytest.fixture(scope="module")
def right(scans):
    source, target = scans
    return explain_scans(open3d_cloud(source), target)


def test_a_right_registration_is_told_from_a_wrong_one(scans, right):
    source, target = scans
    error = transform(right.T_target_source, source) - transform(TRUE, source)
    assert np.linalg.norm(error, axis=1).max() < 0.1
    assert right.state == "nominal"
    assert 0.6 < right.overlap[0] < 0.9
    turned = exp(np.array([[0, 0, 2.5, 0, 0, 0]]))[0]
    wrong = explain_scans(source, target, turned)
    assert wrong.failure > right.failure
    assert wrong.state in ("failed", NOT_SURE)
    assert "learned from objects, is not used" in wrong.learned_from
    said = json.loads(json.dumps(wrong.as_dict()))
    assert said["state"] == wrong.state
    for words in (wrong.advice, wrong.reason, "overlap   "):
        assert words in wrong.text()


def test_a_pose_in_text_is_that_in_json_at_utm_coordinates(scans):
    """Six significant digits were more than a meter off there."""
    offset = np.array([539_719.0, 4_065_740.0, 0.0])
    source, target = (cloud + offset for cloud in scans)
    explanation = explain_scans(source, target)
    rows = explanation.text().partition("T_target_source, in m\n")[2].splitlines()[:4]
    printed = np.array([row.split() for row in rows], float)
    moved = [transform(np.array(T), source) for T in (printed, explanation.as_dict()["T_target_source"])]
    assert np.abs(moved[0] - moved[1]).max() < 1e-5


def error_of(T_target_source, source, T_true=TRUE):
    return float(displacements((T_target_source @ inverse(T_true))[None], transform(T_true, source))[0])


@pytest.mark.parametrize("turn", [0.7, 2.5])
def test_the_result_is_among_its_poses_and_no_pose_is_there_twice(scans, turn):
    source, target = scans
    said = explain_scans(source, target, exp(np.array([[0, 0, turn, 0, 0, 0]]))[0])
    poses = said.reenacted.poses
    [result] = [pose for pose in poses if pose.registered]
    np.testing.assert_allclose(result.T_target_source, said.T_target_source, atol=1e-6)
    assert sum(pose.probability for pose in poses) == pytest.approx(1)
    for one, other in combinations(poses, 2):
        assert error_of(one.T_target_source, source, other.T_target_source) > said.voxel / 2
    if said.state == "nominal":
        assert result.probability > 0.5


def test_of_both_icps_the_better_is_kept(scans):
    source, target = (in_voxels(points, 0.3, "scan", "m") for points in scans)
    icp = VoxelICP(target, estimate_normals(target), 0.3)
    starts_n = exp(np.array([[0, 0, turn, 0, 0, 0] for turn in (0.0, 0.3, 0.8, 1.5)]))
    _, fitness_n, rmse_n = icp.register(source, starts_n)
    _, fine_fitness_n, fine_rmse_n = icp.refine(source, starts_n)
    reach = 0.3 * COARSE_TO_FINE[-1]
    cost_n = clipped_cost(fitness_n, rmse_n, reach)
    assert (cost_n <= clipped_cost(fine_fitness_n, fine_rmse_n, reach) + 1e-12).all()
    assert (cost_n < clipped_cost(fine_fitness_n, fine_rmse_n, reach) - 1e-3).any()


@pytest.mark.parametrize("plane", [np.eye(4), exp(np.array([[0.9, -0.4, 0.3, 1, 2, 3]]))[0]])
def test_flat_scans_are_registered_in_their_plane(plane):
    sides = np.linspace(0, 1, 60)[:, None] * [[1.0, 0]], np.linspace(0, 1, 60)[:, None] * [[0, 0.7]]
    boxes = [
        corner + side for corner in ([0, 0], [1.2, 0.5]) for side in (*sides, sides[0] + [0, 0.7], sides[1] + [1, 0])
    ]
    target = transform(plane, np.column_stack([np.concatenate(boxes), np.zeros(480)]))
    T_true = plane @ exp(np.array([[0, 0, 0.105, 0.1, -0.06, 0]]))[0] @ inverse(plane)
    source = transform(inverse(T_true), target)
    said = explain_scans(source, target)
    assert error_of(said.T_target_source, source, T_true) < 0.01
    assert said.state == "nominal"
    assert said.method.startswith("point_to_point")
    assert any("the scans are flat" in note for note in said.notes)


FAR = np.array([539_000.0, 4_065_000, 2])


def test_a_given_pose_is_judged_as_it_is(scans):
    source, target = scans[0], scans[1] + FAR
    T_true = TRUE.copy()
    T_true[:3, 3] += FAR
    said = explain_scans(source, target, T_target_source=T_true)
    np.testing.assert_allclose(said.T_target_source, T_true, rtol=1e-9, atol=1e-6)
    assert (said.state, said.method, said.moved) == ("nominal", GIVEN, None)
    T_off = T_true.copy()
    T_off[0, 3] += 3
    off = explain_scans(source, target, T_target_source=T_off)
    np.testing.assert_allclose(off.T_target_source, T_off, rtol=1e-9, atol=1e-6)
    assert off.state == "failed"
    assert error_of(off.fitting_pose, source, T_true) < off.limit


def test_a_limit_is_kept_and_by_default_said(scans, right):
    source, target = scans
    assert right.limit == pytest.approx(2 * right.voxel)
    assert right.limit < 0.05 * np.linalg.norm(np.ptp(target, axis=0))
    assert f"of an error above {length(right.limit, 'm')}" in right.text()
    tight = explain_scans(source, target, limit=0.01)
    assert tight.limit == 0.01
    assert tight.failure > right.failure
    assert tight.state != "nominal"  # voxels of 0.2 m do not tell


def test_neither_a_poor_fit_nor_another_pose_alone_is_a_close_call():
    assert GOOD <= failure_of(Evidence(elsewhere=0.0, apart=1.3, overlap=0.6)) < 0.4
    assert failure_of(Evidence(elsewhere=0.4, apart=1.1, overlap=0.6)) >= BAD
    assert failure_of(Evidence(elsewhere=1.0, apart=0.55, overlap=0.6)) >= 0.6
    assert failure_of(Evidence(elsewhere=0.0, apart=0.8, overlap=0.6)) < 0.1
    assert failure_of(Evidence(elsewhere=0.0, apart=0.0, overlap=0.0)) == 1


def test_little_overlap_is_not_sure(scans):
    source, target = scans
    T_off = TRUE.copy()
    T_off[0, 3] += 10.0
    little = explain_scans(source, target, T_target_source=T_off)
    assert 0 < little.overlap[0] < LEAST_OVERLAP
    assert little.state == NOT_SURE
    assert state_of(1.0, 0.1) == state_of(0.0, 0.1) == NOT_SURE


@pytest.mark.parametrize(("estimator", "words"), [("brossard", "by brossard"), ("monte_carlo", "by monte_carlo")])
def test_an_estimator_says_how_far_the_pose_may_vary(scans, estimator, words):
    said = explain_scans(*scans, estimator=estimator)
    assert 0 < said.spread.translation < 1
    assert words in said.text()
    assert said.as_dict()["spread"]["estimator"] == estimator


def test_an_estimator_that_fails_is_a_note(scans):
    said = explain_scans(*scans, estimator="censi")
    assert said.spread is None
    assert any(note.startswith("censi gives no covariance") for note in said.notes)


def apart(share, seed=0):
    """Two scans from opposite ends of a room, each of this share of it."""
    return transform(inverse(TRUE), room(seed, 0.0, share)), room(seed + 1, 1 - share, 1.0)


def test_overlap_is_named_where_the_common_parts_alone_would_have_been_registered():
    source, target = apart(0.65)
    said = explain_scans(source, target, exp(np.array([[0, 0, -0.4, 0, 1.0, 0]]))[0] @ TRUE)
    assert error_of(said.T_target_source, source) > said.limit
    assert said.state == "failed"
    assert error_of(said.fitting_pose, source) < said.limit
    assert "overlap" in said.causes
    assert f"causes    {' and '.join(said.causes)}" in said.text()


def test_a_right_result_does_not_fail_because_the_scans_would_overlap_more_at_another_pose():
    source, target = apart(0.6, seed=10)
    said = explain_scans(source, target, TRUE)
    assert said.overlap[0] < 0.35
    assert error_of(said.T_target_source, source) < said.limit / 2
    assert said.state == "nominal"


def test_a_source_far_from_the_target_has_failed(scans):
    source, target = scans
    far = explain_scans(source, target + np.array([0, 5000, 0]))
    assert (far.state, far.failure, far.overlap) == ("failed", 1.0, (0.0, 0.0))
    assert far.reason.startswith("no point of the source lies on the target")


def test_the_command_explains_scans_of_two_formats_in_another_unit_without_a_model(
    scans, right, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    source, target = (100 * points for points in scans)
    np.column_stack([source, np.zeros(len(source))]).astype("<f4").tofile("scan1.bin")
    np.savez("scan2.npz", points=target)
    words = ["explain", "scan1.bin", "scan2.npz", "--scans", "--unit", "cm", "--json", "--html", "page.html"]
    assert main(words) == 0
    out, err = capsys.readouterr()
    in_cm = json.loads(out)
    assert (in_cm["state"], in_cm["unit"], in_cm["source"]) == (right.state, "cm", "scan1.bin")
    assert in_cm["voxel"] == pytest.approx(100 * right.voxel, rel=1e-3)
    assert in_cm["limit"] == pytest.approx(100 * right.limit, rel=1e-2)
    assert f"page page.html\n{right.learned_from}\n" in err
    page = (tmp_path / "page.html").read_text()
    assert "<dt>Source</dt><dd>scan1.bin</dd>" in page
    assert "Common parts alone" in page
    assert len(page) < 2 * 10**6


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--fast"], "--fast: is not for scans; leave it out"),
        (["--tolerance", "2deg"], "--tolerance: '2deg' is no length"),
        (["--method", "nearest"], "registration method 'nearest': unknown"),
        (["--init", "lost.txt"], "lost.txt: no such file"),
    ],
)
def test_an_option_that_does_not_fit_scans_is_one_line(scans, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    np.save("scan.npy", scans[0])
    assert main(["explain", "scan.npy", "scan.npy", "--scans", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err.splitlines()[-1]


WIDE = np.random.default_rng(0).uniform(-40, 40, (200, 3))
WRITERS = {
    "npy": np.save,
    "npz": lambda path, points: np.savez(path, points=points),
    **dict.fromkeys(("xyz", "txt", "asc", "pts"), np.savetxt),
    "csv": lambda path, points: np.savetxt(path, points, delimiter=","),
    "bin": lambda path, points: np.column_stack([points, np.abs(points[:, 0]) / 40]).astype("<f4").tofile(path),
    "ply": lambda path, points: trimesh.PointCloud(points).export(path),
}


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_scan_of_80_m_is_read_from_every_format(tmp_path, suffix):
    WRITERS[suffix](path := tmp_path / f"scan.{suffix}", WIDE)
    np.testing.assert_allclose(read_points(path), WIDE, atol=1e-5)


def test_voxels_are_chosen_by_the_spacing_and_leave_few(scans):
    clouds = {"source": scans[0], "target": scans[1]}
    edge = voxel_size(clouds, "m")
    assert 0.05 < edge < 1
    assert 1000 < len(in_voxels(scans[0], edge, "source", "m")) <= 4000
    twice = {name: np.concatenate([points, points]) for name, points in clouds.items()}
    assert voxel_size(twice, "m") == pytest.approx(edge, rel=0.2)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"voxel": 20.0}, "source: fills .* voxels of 20 m; give both in one unit, and voxels so small that"),
        (
            {"voxel": 1e-9},
            "source: spans .* m, too much for voxels of 0.000000001 m; leave out points that are far away",
        ),
        ({"voxel": -1.0}, "voxel: -1 is no length"),
        ({"limit": 0.0}, "limit: 0 is no length; give a positive one"),
        ({"T_target_source": np.ones((4, 4))}, "pose is not a rigid transform"),
        ({"method": "nearest"}, "registration method 'nearest': unknown"),
        ({"unit": "feet"}, "unit 'feet'"),
        ({"T_target_source_init": 2 * np.eye(4)}, "initial pose: the pose is not a rigid transform"),
        (
            dict.fromkeys(("source_points", "target_points"), np.ones((99, 3))),
            "source: has all its points in one place",
        ),
    ],
)
def test_bad_input_is_one_line(scans, change, message):
    with pytest.raises(InputError, match=message):
        explain_scans(**{"source_points": scans[0], "target_points": scans[1]} | change)


def test_noise_on_noise_is_no_success_and_surfaces_are_no_noise(monkeypatch):
    random = np.random.default_rng(0)
    noise, plane = random.uniform(size=(600, 3)), random.uniform(size=(600, 3)) * (1, 1, 0.01)
    assert Scans(noise, plane, 0.1).fills_volume and Scans(plane, noise, 0.1).fills_volume
    assert not Scans(plane, plane, 0.1).fills_volume
    monkeypatch.setattr(scan_explainer, "failure_of", lambda _evidence: 0.01)
    explanation = explain_scans(noise, noise)
    assert explanation.state == NOT_SURE and "as noise does" in explanation.warnings[0]
