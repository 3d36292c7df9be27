from dataclasses import replace

import numpy as np
import pytest

from baselines.dirichlet_gp import JITTER, DirichletGP
from gpca.pairs.perturbation import CONCEPTS


@pytest.fixture(scope="module")
def embedded(registrations):
    random = np.random.default_rng(0)
    concept_S = [CONCEPTS.index(concept) for concept in registrations.concept]
    embedding = 2 * random.normal(size=(3, 6))[concept_S] + random.normal(size=(len(registrations), 6))
    return replace(registrations, attached={"embedding": embedding})


def fitted(embedded, **settings):
    learner = DirichletGP("tiny", 0, **settings)
    learner.fit(embedded.subset(embedded.rows("train")))
    return learner


def test_the_posterior_is_the_textbooks(embedded):
    """Mean m + k (K + S)^-1 (y - m) and variance k(x, x) - k (K + S)^-1 k, targets and noise from Milios et al."""
    learner, alpha = fitted(embedded, iterations=3, alpha=0.1), 0.1
    train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
    scale, length = np.exp(learner._log_scale_C.detach().numpy()), np.exp(learner._log_lengthscale_C.detach().numpy())
    x, z = (learner._scaler.transform(part.embedding) for part in (train, test))
    squares = {name: ((a[:, None] - b) ** 2).sum(axis=2) for name, a, b in (("xx", x, x), ("zx", z, x))}
    mean_N_C, deviation_N_C = learner._posterior(test)
    for c, concept in enumerate(CONCEPTS):
        concentration = alpha + (train.concept == concept)
        noise = np.log(1 / concentration + 1)
        y = np.log(concentration) - noise / 2
        K = scale[c] * np.exp(-squares["xx"] / (2 * length[c] ** 2)) + np.diag(noise + JITTER)
        k = scale[c] * np.exp(-squares["zx"] / (2 * length[c] ** 2))
        m = learner._mean_C[c].item()
        assert mean_N_C[:, c] == pytest.approx(m + k @ np.linalg.solve(K, y - m), abs=1e-5)
        variance = scale[c] - np.einsum("nt,tn->n", k, np.linalg.solve(K, k.T))
        assert deviation_N_C[:, c] ** 2 == pytest.approx(variance, abs=1e-5)


def test_a_smaller_alpha_is_more_confident(embedded):
    test = embedded.subset(embedded.rows("test"))
    small, large = (fitted(embedded, alpha=alpha).explain(test).scores_N_C.max(axis=1).mean() for alpha in (0.01, 0.5))
    assert small > large


def test_far_away_the_posterior_is_the_prior(embedded):
    learner, test = fitted(embedded), embedded.subset(embedded.rows("test"))
    far = replace(test, attached={"embedding": test.embedding + 1e4})
    assert learner.explain(far).bald_N.min() > learner.explain(test).bald_N.mean()
