"""Sizes of the shipped configs that have to fit each other, though they stand in different sections."""

import pytest

from .configs import load


@pytest.mark.parametrize("names", [(), ("smoke",), ("full",)])
def test_the_shipped_configs_have_training_samples_for_every_start(names):
    config = load(*names)
    train, active = config["registrations"]["train"], config["active_learning"]
    pool = config["readings"]["groups"]["pool"]
    for initial in (active["initial"], *([min(pool["initial"])] if pool else [])):
        assert initial // 2 < train // 3
    stream, known = active["stream"], 2 * (train // 3 - active["initial"] // 2)
    new = round((stream["arrivals"] - stream["quiet"]) / 3)
    assert 0 < new <= train // 3
    assert stream["arrivals"] - new <= known
    for cause in ("noise", "pose", "overlap"):
        assert active["initial"] // 3 <= round(config["causes"]["shares"][cause] * config["causes"]["train"])
