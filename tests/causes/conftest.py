"""Four procedural objects, one of them symmetric, and few candidates of them."""

import pytest

from gpca.causes.drawing import draw_causes
from gpca.causes.settings import CauseSettings
from gpca.causes.subjects import read_subjects

NAMES = ("002_master_chef_can", "019_pitcher_base", "035_power_drill", "037_scissors")
FEW = {"train": 12, "test": 8, "points": (128, 256), "clean_pairs": 20}


@pytest.fixture(scope="session")
def four(tmp_path_factory):
    from gpca.objects.canonical import ObjectClouds, write_objects
    from gpca.objects.procedural import surfaces

    path = tmp_path_factory.mktemp("objects") / "four.npz"
    write_objects((surface for surface in surfaces("ycb") if surface.name in NAMES), "four", path, n_points=6000)
    return ObjectClouds.load(path)


@pytest.fixture(scope="session")
def subjects(four):
    return read_subjects(four)


@pytest.fixture(scope="session")
def drawn(four):
    """Causes, tally and seconds."""
    return draw_causes(four, "four", 100, CauseSettings(**FEW))


@pytest.fixture(scope="session")
def causes(drawn):
    return drawn[0]
