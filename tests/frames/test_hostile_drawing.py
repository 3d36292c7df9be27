"""Settings and folders that the step ``scenes`` refuses."""

import json
import shutil

import pytest

from ..hostile import refusal

SETTINGS = {
    "no room": ({"gap_m": 1.0, "objects": [8, 8]}, "there is no room for 8 objects 1.0 m apart"),
    "downwards": ({"objects": [5, 2]}, "scenes objects: [5, 2] is in descending order"),
    "a family that is none": ({"families": ["spoons"]}, "family 'spoons': no such procedural family"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_of_scenes_that_cannot_be(tmp_path, name):
    given, words = SETTINGS[name]
    small = {"count": 2, "views": 1, "camera": {"width": 64, "height": 48, "focal_px": 60}, "families": ["linemod"]}
    arguments = ["scenes", "--source", "tiny", "--settings", json.dumps({**small, **given}), "--out", "drawn"]
    refusal(arguments, tmp_path, words)


def test_scenes_replace_scenes(scenes, tmp_path):
    from gpca.frames.rgbd_scene import write_scenes

    from .tiny import scene_settings, surfaces

    shutil.copytree(scenes, tmp_path / "tiny")
    write_scenes(surfaces(), "tiny", scene_settings(count=2, views=1), tmp_path / "tiny")
    assert len(list((tmp_path / "tiny").rglob("depth/*.png"))) == 2
