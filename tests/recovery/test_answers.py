from types import SimpleNamespace

import numpy as np
import pytest

from gpca.encoders.registry import EncoderSettings
from gpca.recovery.answers import as_shares, learn_explainers
from gpca.uncertainty.settings import UncertaintySettings


def test_signed_scores_become_shares():
    shares = as_shares(np.array([[0.2, 0.3, 0.5]]))
    assert shares.tolist() == [[0.2, 0.3, 0.5]]
    signed = as_shares(np.array([[-1.0, 0.0, 2.0]]))
    assert signed.sum() == pytest.approx(1)
    assert signed[0].argmax() == 2


ENCODER = EncoderSettings(draw_points=32, draws=1, epochs=1, batch_size=12, options={"k": 4, "point_features": 16})
EXPLAINERS = {"gpca": {"iterations": 5, "inducing": 4, "draws": 20}}


def test_an_answer_needs_no_label_and_takes_time_and_remedies_cost_registrations(registrations):
    uncertainty, section = UncertaintySettings(starts=13, icp_points=32), {"remedied": 9}
    settings = SimpleNamespace(encoder=ENCODER, explainers=EXPLAINERS, uncertainty=uncertainty, section=section)
    learned = learn_explainers(("gpca", "sa_supervised"), registrations, settings, "tiny", 0)
    some = registrations.subset(registrations.rows("test")[:3]).without_labels()
    answers = {name: explain(some) for name, explain in learned.items()}
    assert list(answers) == ["gpca", "sa_supervised"]
    for answer in answers.values():
        assert answer.scores_N_C.shape == (3, 3)
        assert (answer.seconds_N > 0).all()
    assert not answers["gpca"].icp_calls_N.any()
    assert (answers["sa_supervised"].icp_calls_N > 0).all()
