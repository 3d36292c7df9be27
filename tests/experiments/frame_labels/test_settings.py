from gpca.active_learning.settings import RetrainingSettings
from gpca.experiments.frame_labels.settings import FrameLabelSettings, rounds_of


def test_rounds_on_frames_take_what_rare_concepts_share_with_them():
    rare = {"shares": [0.05, 0.01], "beside_seeds": 1, "labels": 550, "least": 60, "batch": 2, "late_batch": 10}
    found = rounds_of(FrameLabelSettings(labels=30, least=12), rare)
    assert found == RetrainingSettings(labels=30, least=12, batch=2, late_batch=10)
