"""Whether a given pose is right: nothing is registered, and the pose that fits is handed over."""

import json

import numpy as np
import pytest

import gpca
from gpca.__main__ import main
from gpca.causes.policy import NOTHING
from gpca.causes.truth import FAILED
from gpca.errors import InputError
from gpca.model.diagnosis import RERUN
from gpca.model.explanation import GIVEN
from gpca.model.location import SHIPPED
from gpca.rigid import exp, transform


def shifted(distance):
    return exp(np.array([[0, 0, 0, distance, 0, 0]]))[0]


@pytest.mark.parametrize("distance", [0.0, 0.3])
def test_the_given_pose_is_judged_and_not_moved(explainer, pair, distance):
    source, target = pair
    T_right = explainer.explain(source, target).T_target_source
    scale = float(np.linalg.norm(np.ptp(target, axis=0)))
    T = shifted(distance * scale) @ T_right
    judged = explainer.judge(source, target, T)
    np.testing.assert_allclose(judged.T_target_source, T, atol=1e-12)
    assert judged.method == GIVEN
    assert judged.moved is None
    near = np.linalg.norm(transform(T, source)[:, None] - target, axis=2).min(axis=1) <= 0.1 * scale
    assert judged.fitness == pytest.approx(near.mean(), abs=0.05)


def test_a_registration_says_how_far_it_moved(explainer, pair):
    source, target = pair
    assert explainer.explain(source, target).moved is None  # no initial pose was given
    T_right = explainer.explain(source, target).T_target_source
    scale = float(np.linalg.norm(np.ptp(target, axis=0)))
    moved = explainer.explain(source, target, shifted(0.05 * scale) @ T_right).moved
    assert moved.distance == pytest.approx(0.05 * scale, rel=0.2)
    assert moved.rotation_deg < 10


def write(folder, source, target, T):
    np.save(folder / "source.npy", source)
    np.save(folder / "target.npy", target)
    np.savetxt(folder / "pose.txt", T)


def test_a_pose_is_saved_as_its_name_says(explainer, pair, tmp_path):
    judged = explainer.judge(*pair, np.eye(4))
    judged.save_pose(tmp_path / "pose.npy")
    judged.save_pose(tmp_path / "pose.txt")
    np.testing.assert_array_equal(np.load(tmp_path / "pose.npy"), judged.fitting_pose)
    np.testing.assert_array_equal(np.loadtxt(tmp_path / "pose.txt"), judged.fitting_pose)


def test_points_that_are_repeated_do_not_count(explainer, pair):
    source, target = pair
    with pytest.raises(InputError, match="source: has 30 distinct points; give 64 or more"):
        explainer.judge(np.repeat(source[:30], 10, axis=0), target, np.eye(4))


def test_the_command_judges_a_pose_and_saves_the_one_that_fits(pair, saved, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    source, target = pair
    write(tmp_path, source, target, np.eye(4))
    words = ["explain", "source.npy", "target.npy", "--model", str(saved), "--json"]
    assert main([*words, "--pose", "pose.txt", "--save-pose", "fits.txt"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["method"] == GIVEN
    assert said["T_target_source"] == np.eye(4).tolist()
    first = said["diagnosis"]["reenacted"]["poses"][0]
    expected = np.eye(4) if first["registered"] else first["T_target_source"]
    np.testing.assert_array_equal(np.loadtxt("fits.txt"), expected)
    assert main([*words, "--init", "fits.txt"]) == 0
    assert json.loads(capsys.readouterr().out)["moved"]["distance"] >= 0


def test_a_wrong_pose_is_called_so_and_the_answer_says_what_to_start_from(explainer, pair):
    source, target = pair
    T_right = explainer.explain(source, target).T_target_source
    scale = float(np.linalg.norm(np.ptp(target, axis=0)))
    wrong = explainer.judge(source, target, shifted(0.25 * scale) @ T_right)
    assert wrong.diagnosis.state == FAILED
    assert wrong.diagnosis.result > 0.9
    better = wrong.diagnosis.reenacted.better
    if better is not None:
        assert wrong.action == RERUN
        np.testing.assert_array_equal(wrong.fitting_pose, better.T_target_source)
        assert "pose 1 as T_target_source, which --save-pose writes" in wrong.text()
    else:
        assert wrong.action != NOTHING


def test_a_narrower_tolerance_makes_the_same_pose_less_likely_right(explainer, pair):
    said = [explainer.explain(*pair, tolerance=text).diagnosis for text in ("1%", "3%", "10%")]
    results = [diagnosis.result for diagnosis in said]
    assert results == sorted(results, reverse=True)
    assert [diagnosis.tolerance_share for diagnosis in said] == pytest.approx([0.01, 0.03, 0.1])


@pytest.mark.parametrize("other", [["--init", "pose.txt"], ["--method", "point_to_point"]])
def test_a_pose_that_is_judged_has_no_start_and_no_method(other, pair, saved, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, *pair, np.eye(4))
    words = ["explain", "source.npy", "target.npy", "--model", str(saved), "--pose", "pose.txt", *other]
    assert main(words) == 2
    assert capsys.readouterr().err.startswith(f"gpca explain: --pose: is judged as it is, without {other[0]}; ")


def test_a_pose_that_is_no_pose_is_refused(explainer, pair):
    with pytest.raises(InputError, match="initial pose"):
        explainer.judge(*pair, np.diag([1.0, 1, -1, 1]))
    assert "judge" in gpca.__all__


def test_a_box_that_slid_along_itself_is_wrong_and_one_that_was_turned_over_is_not():
    random = np.random.default_rng(100)
    size = np.array([0.072, 0.164, 0.213])
    points = random.uniform(-0.5, 0.5, size=(3000, 3))
    axis = random.choice(3, size=len(points), p=(1 / size) / (1 / size).sum())
    points[np.arange(len(points)), axis] = random.choice([-0.5, 0.5], size=len(points))
    source, target = np.split(points * size, 2)
    shipped = gpca.Explainer.load(SHIPPED)
    turned = exp(np.array([[np.pi, 0, 0, 0, 0, 0]]))[0]
    assert shipped.judge(source, target, turned).diagnosis.state != FAILED
    slid = np.eye(4)
    slid[2, 3] = 0.03
    assert shipped.judge(source, target, slid).diagnosis.state == FAILED
