"""The page of an explanation: alone, small, and with all that the explanation says."""

import json
import re
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.truth import ALL, BY_SIZE
from gpca.model.scene import MOST_POINTS, packed, taken_out
from gpca.rigid import rigid_motion, transform

from ..accessible import faults_of
from ..page.test_in_a_browser import chromium, in_a_browser, with_script

LARGEST_BYTES = 2 * 10**6


def unpacked(cloud):
    """The points (N, 3) of a packed cloud, as the page's script reads them."""
    return np.frombuffer(b64decode(cloud["data"]), "<i2").reshape(-1, 3) * cloud["step"]


@pytest.fixture(scope="module")
def explained(explainer, pair):
    return explainer.explain(*pair)


@pytest.fixture(scope="module")
def html(explained):
    return explained.html({"source": "scan <1>.ply"})


def scene_of(html):
    [text] = re.findall(r'<script type="application/json" id="scene">(.*?)</script>', html)
    return json.loads(text)


def test_a_page_is_one_small_file_that_asks_for_no_other(html):
    assert len(html.encode()) < LARGEST_BYTES
    assert not re.search(r"https?:|src=|@import|url\(", html)
    assert re.findall(r'href="([^"]*)"', html) == ["data:,"]
    assert "default-src 'none'" in html
    assert "scan &lt;1&gt;.ply" in html
    assert faults_of(html) == []


def test_a_notebook_shows_the_page_in_a_frame(explained):
    shown = explained._repr_html_()
    assert shown.startswith('<iframe srcdoc="&lt;!doctype html&gt;') and "<script" not in shown


def test_a_page_says_what_the_text_says(html, explained):
    found = explained.diagnosis
    for words in (explained.reason, *explained.diagnosis.causes, found.guarantee.alarm[0], "What to do", "What if?"):
        assert words in html
    for state in found.guarantee.states:
        assert f'<li class="in">{state.replace("several", "several causes")}</li>' in html
    assert html.count('class="what-if"') == 8 * len(found.reenacted.poses)
    for pose in found.reenacted.poses:
        assert f"<span>{pose.probability:.2f}</span>" in html


def test_a_page_holds_both_clouds_and_every_registration_that_was_reenacted(html, explained):
    scene, drawn = explained.scene, scene_of(html)
    np.testing.assert_allclose(unpacked(drawn["target"]), scene.target, atol=1e-4)
    np.testing.assert_allclose(unpacked(drawn["source"]), scene.source, atol=1e-4)
    np.testing.assert_allclose(np.reshape(drawn["found"], (4, 4)), scene.T_found, atol=1e-6)
    assert drawn["diameter"] == scene.frame.diameter
    found = explained.diagnosis.reenacted
    assert len(drawn["poses"]) == len(scene.possibilities) == len(found.poses)
    for pose, possibility, of_page in zip(found.poses, scene.possibilities, drawn["poses"], strict=True):
        assert pose.error == scene.frame.diameter * possibility.errors[ALL]
        assert pose.probability == possibility.probability
        for place, subset in enumerate(BY_SIZE):
            np.testing.assert_allclose(unpacked(of_page["what_ifs"][place]), possibility.clouds[subset], atol=1e-3)


def test_with_a_right_start_on_clean_and_whole_surface_the_cloud_ends_on_the_target(explained):
    """The best case of the most probable pose, up to twice the spacing of the points."""
    from scipy.spatial import cKDTree

    points = explained.scene.possibilities[0].clouds[0]
    assert np.median(cKDTree(explained.scene.target).query(points)[0]) < 0.06


def test_counterfactuals_are_named_by_what_is_taken_out_and_large_clouds_are_thinned():
    assert taken_out(ALL) == "As it was"
    assert taken_out(0) == "Clean points, right start, whole surface"
    assert len({taken_out(subset) for subset in range(8)}) == 8
    points = np.random.default_rng(0).normal(size=(2 * MOST_POINTS, 3))
    assert len(unpacked(packed(points))) == MOST_POINTS


def test_one_of_many_has_no_view_and_an_unknown_one_no_poses(explainer, pair):
    [many] = explainer.explain_many([pair])
    assert many.scene is None
    assert "<canvas" not in many.html()
    assert "<h1" in many.html()
    source, target = pair
    unknown = explainer.explain(source + 100 * np.ptp(target), target)
    assert unknown.unknown
    page = unknown.html()
    assert "The state of this registration is unknown" in page
    assert 'data-view="pose:0"' not in page
    assert "<canvas" in page


def test_the_repaired_or_a_likelier_pose_is_drawn_beside_the_result(explained):
    scene = explained.scene
    assert replace(scene, T_repaired=np.eye(4)).packed("m")["beside"] == "repaired"
    T_likeliest = scene.possibilities[0].T
    T_apart = rigid_motion(np.eye(3), [2 * scene.limit, 0, 0]) @ T_likeliest
    for T_found, beside in ((T_likeliest, None), (T_apart, "pose:0")):
        assert replace(scene, T_found=T_found).packed("m").get("beside") == beside


def test_an_explanation_and_its_scene_are_in_one_frame(explained, pair):
    source, _ = pair
    aligned = transform(explained.T_target_source, source)
    frame = explained.scene.frame
    np.testing.assert_allclose(frame.coordinates(aligned), explained.scene.aligned, atol=1e-6)
    assert replace(explained, scene=None).as_dict() == explained.as_dict()


@in_a_browser
def test_a_browser_draws_every_view_and_has_nothing_to_complain_about(explained, tmp_path):
    choose = """<script>addEventListener("load", () => {
      for (const button of document.querySelectorAll("[data-view]")) button.click();
      document.querySelector('[data-view="what:0:3"]').click();
    });</script>"""
    repaired = replace(explained, scene=replace(explained.scene, T_repaired=explained.scene.T_found))
    # The page's policy allows scripts that stand in it.
    (tmp_path / "page.html").write_text(with_script(repaired.html(), choose))
    shown = chromium(tmp_path / "page.html", tmp_path / "profile", "--dump-dom", "--window-size=400,900")
    assert 'data-shown="what:0:3"' in shown
    assert "Re-enacted as if pose 1 were true, " in shown
    assert "Repaired: the median distance to the target is " in shown
    assert "or more</span>" in shown
