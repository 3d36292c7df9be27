"""Registrations of a user that are put right, and what the command says and writes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

import gpca
from gpca import Explainer
from gpca.__main__ import main
from gpca.alignment.pose_error import displacements
from gpca.model.diagnosis import RERUN, TAKE
from gpca.model.repair import GOOD, NOT_REPAIRED, REPAIRED, SEVERAL, Part
from gpca.model.repaired import STATUSES, side_in_words
from gpca.model.result import Calibrated, ResultJudge
from gpca.rigid import inverse, transform

from .test_judge import shifted
from .test_page import scene_of
from .test_scans import TRUE, room


def judging(model, *calibrated):
    """The model with an untrained judge, which says the weight of hypotheses apart from a pose."""
    levels = (Calibrated(0.01, *calibrated), Calibrated(0.1, *calibrated))
    return replace(model, diagnoser=replace(model.diagnoser, judge=ResultJudge.untrained(), levels=levels))


@pytest.fixture(scope="module")
def wrong(model, pair):
    """A model, the clouds, and a pose that is a quarter of the diameter off."""
    source, target = pair
    T = Explainer(model, device="cpu").explain(source, target).T_target_source
    return judging(model, 0.5), pair, shifted(0.25 * np.linalg.norm(np.ptp(target, axis=0))) @ T


def test_a_wrong_pose_is_replaced_by_one_that_is_called_good(wrong, monkeypatch):
    model, pair, T = wrong
    explainer = Explainer(model, device="cpu")
    repair = explainer.repair(*pair, T, register=False)
    assert repair.verdict == REPAIRED
    assert repair.status == 0
    assert repair.result < 0.5 < repair.registered_result
    np.testing.assert_array_equal(repair.T_registered, T)
    again = explainer.repair(*pair, repair.T_target_source, register=False)
    assert again.verdict == GOOD
    np.testing.assert_array_equal(again.T_target_source, repair.T_target_source)
    assert repair.wrong is None and "guarantee none" in repair.text()
    monkeypatch.setattr("gpca.model.repair.hypotheses.find_hypotheses", None)  # those of the diagnosis are taken
    explanation = explainer.judge(*pair, T, repair=True)
    assert explanation.action == TAKE
    np.testing.assert_array_equal(explanation.repaired.T_target_source, repair.T_target_source)
    np.testing.assert_array_equal(explanation.fitting_pose, repair.T_target_source)
    assert explanation.repaired.registered_result == pytest.approx(explanation.diagnosis.result)
    assert explanation.as_dict()["repaired"]["verdict"] == REPAIRED
    said = " ".join(explanation.text().split())
    assert all(" ".join(line.split()) in said for line in repair.lines())
    scene = scene_of(explanation.html())
    inside = repair.scene.frame.coordinates(transform(repair.T_target_source, pair[0]))
    at_start = repair.scene.frame.coordinates(transform(T, pair[0]))
    np.testing.assert_allclose(transform(np.reshape(scene["repaired"], (4, 4)), at_start), inside, atol=1e-5)


def test_nothing_is_replaced_where_the_pose_is_not_called_failed_or_no_other_is_called_good(wrong):
    model, pair, T = wrong
    explained = replace(Explainer(model, device="cpu").judge(*pair, T), action=RERUN)
    for calibrated, verdict in (((1.1,), GOOD), ((0.5, None, 0.0), NOT_REPAIRED)):
        repair = Explainer(judging(model, *calibrated), device="cpu").repair(*pair, T, register=False)
        assert repair.verdict == verdict
        advised = replace(explained, repaired=repair)
        assert "'gpca repair'" in explained.advice and "'gpca repair'" not in advised.advice
        np.testing.assert_array_equal(repair.T_target_source, T)
        assert repair.result == repair.registered_result
        assert "repaired" not in scene_of(repair.html())


def test_with_a_calibration_the_share_of_wrong_repairs_is_promised(wrong):
    model, pair, T = wrong
    repair = Explainer(judging(model, 0.5, None, 0.4), device="cpu").repair(*pair, T, register=False)
    assert (repair.verdict, repair.wrong) == (REPAIRED, 0.05)
    assert "guarantee at most 5% of repaired poses are wrong, on objects like those of calibration" in repair.text()


def test_poses_that_fit_alike_are_given_with_what_tells_them_apart(wrong):
    model, pair, T = wrong
    repair = Explainer(model, device="cpu").repair(*pair, T, register=False)
    [first, *_] = repair.poses
    other = replace(first, differs=Part((0.0, -1.0, 0.0), 0.1), differs_by=0.002)
    several = replace(repair, verdict=SEVERAL, poses=(first, other))
    assert several.status == 5
    said = " ".join(several.text().split())
    assert "; differs from pose 1 by 0.002 m on 10% of the target, on its -y side" in said
    assert side_in_words((0.6, 0.0, 0.8)) == "toward (0.60, 0.00, 0.80) in its frame"


def test_a_pair_without_meaning_is_unknown(explainer, pair):
    source, target = pair
    repair = explainer.repair(0.2 * source, target)
    assert (repair.verdict, repair.status, repair.result) == ("unknown", 3, None)
    assert repair.text().startswith("warning ")
    assert len(set(STATUSES.values()) - {0}) == 3


def test_a_registration_far_from_the_target_is_repaired_without_its_start(wrong):
    model, (source, target), _ = wrong
    explainer, away = Explainer(model, device="cpu"), source + 100 * np.ptp(target)
    assert explainer.explain(away, target).unknown
    repair = explainer.repair(away, target)
    assert repair.verdict in (REPAIRED, SEVERAL, NOT_REPAIRED)
    assert repair.wrong is None and "poses were sought anywhere" in " ".join(repair.text().split())
    distance_N = cKDTree(target).query(transform(repair.poses[0].T_target_source, away))[0]
    assert np.median(distance_N) < 0.05 * np.linalg.norm(np.ptp(target, axis=0))


@pytest.fixture
def folder(wrong, tmp_path, monkeypatch):
    model, (source, target), T = wrong
    monkeypatch.chdir(tmp_path)
    model.save("model.pt")
    np.save("source.npy", source)
    np.save("target.npy", target)
    np.savetxt("wrong.txt", T)
    return ["repair", "source.npy", "target.npy", "--model", "model.pt"]


def test_the_command_writes_a_pose_that_is_settled_and_its_page(folder, wrong, capsys):
    assert main([*folder, "--pose", "wrong.txt", "--out", "T.txt", "--html", "page.html", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] == REPAIRED
    np.testing.assert_array_equal(np.loadtxt("T.txt"), said["T_target_source"])
    assert "repaired" in scene_of(Path("page.html").read_text())
    Path("pairs.csv").write_text("source,target,init\nsource.npy,target.npy,T.txt\nsource.npy,gone.npy,\n")
    assert main(["repair", "--pairs", "pairs.csv", "--json-lines", "--model", "model.pt"]) == 2
    output = capsys.readouterr()
    right, faulty = map(json.loads, output.out.splitlines())
    assert right["verdict"] in (GOOD, REPAIRED)
    assert faulty["error"].startswith("gone.npy: no such file")
    assert "gpca repair: pairs.csv, line 3: gone.npy: no such file" in output.err


def test_the_command_says_by_its_status_that_no_pose_is_settled(folder, wrong, capsys):
    judging(wrong[0], 0.5, None, 0.0).save("model.pt")
    assert main([*folder, "--pose", "wrong.txt", "--out", "T.txt"]) == 4
    assert not Path("T.txt").exists()
    assert "T.txt is not written: no pose is good or repaired" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["--out", "source.npy"], "source.npy: is also an input or another output"),
        (["--init", "wrong.txt", "--out", "wrong.txt"], "wrong.txt: is also an input or another output"),
        (["--scans"], "--model: is not for scans"),
    ],
)
def test_the_command_refuses(folder, words, fault, capsys):
    assert main([*folder, *words]) == 2
    assert capsys.readouterr().err.startswith(f"gpca repair: {fault}")


def test_a_pose_between_scans_is_put_right_in_the_same_words(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    np.save("source.npy", transform(inverse(TRUE), room(0, 0.0, 0.8)))
    np.save("target.npy", room(1, 0.2, 1.0))
    np.savetxt("wrong.txt", shifted(1.5) @ TRUE)
    words = ["repair", "source.npy", "target.npy", "--scans", "--pose", "wrong.txt", "--out", "T.txt", "--json"]
    assert main(words) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] == REPAIRED
    assert said["result"] < 0.2 < said["registered_result"]
    assert said["wrong"] is None
    assert displacements((np.loadtxt("T.txt") @ inverse(TRUE))[None], np.load("target.npy"))[0] < 0.1
    assert main([*words[:-1], "--pose", "T.txt", "--out", "again.txt", "--html", "page.html"]) == 0
    assert capsys.readouterr().out.startswith("repair    good: ")


def test_it_is_a_name_of_the_package(wrong, pair, monkeypatch, tmp_path):
    wrong[0].save(tmp_path / "model.pt")
    monkeypatch.setenv("GPCA_MODEL", str(tmp_path / "model.pt"))
    assert gpca.repair(*pair).verdict in STATUSES
