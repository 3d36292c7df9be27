import numpy as np
import pytest

from gpca.experiments.recovery.answers import as_shares


def test_signed_scores_become_shares():
    shares = as_shares(np.array([[0.2, 0.3, 0.5]]))
    assert shares.tolist() == [[0.2, 0.3, 0.5]]
    signed = as_shares(np.array([[-1.0, 0.0, 2.0]]))
    assert signed.sum() == pytest.approx(1)
    assert signed[0].argmax() == 2
