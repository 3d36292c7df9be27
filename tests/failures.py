"""Tiny virtual tables, and one failure on them."""

import pytest

from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import Shelf, Situations, SituationSettings
from gpca.objects.camera import Camera, DepthNoise
from gpca.recovery.episodes import register_first
from gpca.recovery.settings import LoopSettings

from .frames.tiny import scene_settings, surfaces

CLEAR = 0.1  # diameters; beyond doubt, this is a failure
LOOP = LoopSettings(failures=1, tries=12, budget=3, cloud_points=400)


@pytest.fixture(scope="session")
def situations():
    shelf = Shelf(surfaces(), "tiny", 1024, InitialPoseSettings(tries=2))
    scenes = scene_settings(noise=DepthNoise(), objects=(3, 3), count=2, camera=Camera(160, 120, 285))
    settings = SituationSettings(scenes=scenes, noise_scale=(5.0, 8.0), hidden=(0.5, 0.95))
    return {part: Situations(shelf, settings, ("tiny", 1, part)) for part in ("train", "test", "failures")}


@pytest.fixture(scope="session")
def start(situations):
    """A bad initial pose of the bracket, which no rotation leaves as it is, and the first registration from it."""
    for number in range(60):
        disturbed, _ = situations["failures"].draw("pose", "pose", number)
        outcome = register_first(disturbed, LOOP)
        if outcome is not None and outcome.error > CLEAR:
            return disturbed, outcome
    raise AssertionError("no failure")
