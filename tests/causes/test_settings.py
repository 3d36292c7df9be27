import pytest

from gpca.causes.settings import CauseSettings, CauseSeverities
from gpca.errors import InputError

FAULTS = [
    ({"limits": {"nominal": 0.05}}, "causes limits: nominal 0.05 exceeds failed 0.03; raise failed or lower nominal"),
    ({"shares": {"nominal": 0.5}}, "causes shares: add up to 1.2; make them add up to 1"),
    ({"points": [512, 128]}, r"causes points: \[512, 128\] is in descending order; swap"),
    ({"small": {"crop": 0.96}}, "causes|small.crop"),
    ({"small": {"rotation_deg": -1}}, "small.rotation_deg"),
    ({"severities": {"outliers": [0.2, 0.1]}}, r"severity outliers: \[0.2, 0.1\] is in descending order"),
    ({"several": [0.7, 0.3]}, r"causes several: \[0.7, 0.3\] is in descending order"),
]


@pytest.mark.parametrize(("given", "message"), FAULTS)
def test_settings_that_contradict_each_other_are_refused(given, message):
    with pytest.raises(InputError, match=message):
        CauseSettings.from_dict(given)


def test_settings_come_from_the_sections_of_the_config():
    settings = CauseSettings.from_dict({"severities": {"noise": [0, 0.1]}, "points": [64, 64]}, {"max_iterations": 7})
    assert settings.severities == CauseSeverities(noise=(0, 0.1))
    assert settings.points == (64, 64)
    assert settings.icp.max_iterations == 7
