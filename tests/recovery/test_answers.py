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
SETTINGS = {"gpca": {"iterations": 5, "inducing": 4, "draws": 20}}


@pytest.fixture(scope="module")
def learned(registrations):
    names = ("gpca", "sa_supervised")
    uncertainty = UncertaintySettings(starts=13, icp_points=32)
    return learn_explainers(names, registrations, ENCODER, SETTINGS, uncertainty, 9, "tiny", 0)


def test_each_speaks_of_all_calibration_samples_and_is_judged_by_their_truth(learned, registrations):
    held_out = registrations.rows("test")
    assert list(learned.calibration) == ["gpca", "sa_supervised"]
    for name, attribution in learned.calibration.items():
        assert attribution.scores_N_C.shape == (len(held_out), 3)
        predicted = np.array([attribution.concepts[column] for column in attribution.scores_N_C.argmax(axis=1)])
        assert (learned.right(name) == (predicted == registrations.concept[held_out])).all()


def test_what_is_said_needs_no_label_and_takes_time(learned, registrations):
    some = registrations.subset(registrations.rows("test")[:3])
    for name, explain in learned.explain.items():
        said = explain(some.without_labels())
        assert said.scores_N_C == pytest.approx(learned.calibration[name].scores_N_C[:3], abs=1e-4)
        assert (said.seconds_N > 0).all()
