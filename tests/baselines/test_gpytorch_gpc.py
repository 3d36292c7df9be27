from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.explainers.registry import explainer_entry
from gpca.pairs.perturbation import CONCEPTS

SETTINGS = {"iterations": 15, "inducing": 8, "draws": 100, "learning_rate": 0.05}


@pytest.fixture(scope="module")
def halves(registrations):
    random = np.random.default_rng(0)
    h_S_6 = random.normal(size=(len(registrations), 6)).astype(np.float32)
    h_S_6[:, :3] += 3 * (registrations.concept[:, None] == np.array(CONCEPTS))
    embedded = replace(registrations, attached={"embedding": h_S_6})
    return [embedded.subset(embedded.rows(split)) for split in ("train", "test")]


def explained(name, train, test, seed=0):
    explainer = explainer_entry(name).make("tiny", seed, **SETTINGS)
    explainer.fit(train)
    return explainer.explain(test.without_labels())


def test_it_says_what_gp_ca_says(halves):
    ours, theirs = (explained(name, *halves) for name in ("gpca_paper", "gpca_gpytorch"))
    assert theirs.predicted_N.tolist() == ours.predicted_N.tolist()
    assert np.mean(theirs.predicted_N == halves[1].concept) > 0.6  # chance is a third
    for name in ("scores_N_C", "variances_N_C", "bald_N"):
        assert getattr(theirs, name) == pytest.approx(getattr(ours, name), abs=1e-4)
    assert not theirs.icp_calls_N.any()
    assert (theirs.seconds_N > 0).all()


def test_too_few_labels_are_refused_in_one_line(halves):
    train, test = halves
    with pytest.raises(InputError, match="3 samples for 3 classes"):
        explained("gpca_gpytorch", train.subset(np.arange(3)), test)
