"""Where nothing is perfect, no label is given away to a rule that learns nothing."""

import numpy as np
import pytest

from baselines.untrained import Rule
from gpca.causes.dataset import labels_of
from gpca.causes.drawing import draw_causes
from gpca.causes.settings import CauseSettings
from gpca.config.layers import with_defaults
from gpca.pairs.perturbation import CONCEPTS

CONFIG = with_defaults()
FEWER = {"train": 30, "test": 12, "clean_pairs": 20, "points": (128, 256)}
LIMITS = {"nominal": 0.02, "failed": 0.03}
CAUSES = CONFIG["causes"] | {"limits": LIMITS, "shares": CONFIG["controls"]["hard"]["shares"]}


@pytest.mark.parametrize("settings", [CAUSES, CONFIG["causes"] | CONFIG["controls"]["hard"]], ids=["causes", "hard"])
def test_a_rule_of_three_lines_is_near_chance(four, settings):
    causes, _, _ = draw_causes(four, "four", 100, CauseSettings.from_dict(settings | FEWER))
    label_S = labels_of(causes.truth)
    named_S = np.array(CONCEPTS)[Rule("four", 100).scores(causes.registrations).argmax(axis=1)]
    recall = [(named_S[label_S == concept] == concept).mean() for concept in CONCEPTS]
    assert set(label_S) == set(CONCEPTS)
    assert np.mean(recall) <= 1 / 3 + 0.1
