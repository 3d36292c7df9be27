import numpy as np
import pytest

from baselines.rules import ResidualRules
from gpca.errors import InputError
from gpca.explainers.registry import explainer_entry, require_settings


@pytest.fixture(scope="module")
def fitted():
    """A tree that learned three concepts which two thresholds tell apart."""
    random = np.random.default_rng(0)
    forward_N = np.repeat([0.03, 0.01, 0.01], 40) * random.uniform(0.9, 1.1, 120)
    backward_N = np.repeat([0.01, 0.01, 0.2], 40) * random.uniform(0.9, 1.1, 120)
    explainer = ResidualRules("tiny", 0)
    features_N_3 = np.column_stack([np.log(forward_N), np.log(backward_N), np.full(120, -40.0)])
    explainer._classifier.fit(features_N_3, np.repeat(["noise", "pose", "overlap"], 40))
    return explainer


def test_the_rules_read_as_distances_and_the_concept_that_they_mean(fitted):
    rules = fitted.rules()
    assert len(rules) == 3
    (noise,) = (rule for rule in rules if ": noise (100%)" in rule)
    limit = float(noise.split("distance from source to target > ")[1].split(" d")[0])
    assert 0.011 < limit < 0.027
    (overlap,) = (rule for rule in rules if ": overlap (100%)" in rule)
    limit = float(overlap.split("distance from target to source > ")[1].split(" d")[0])
    assert 0.011 < limit < 0.18


def test_a_deviation_is_the_root_of_the_determinants_sixth_root():
    explainer = ResidualRules("tiny", 0, depth=1)
    log_determinant_N = np.repeat([12 * np.log(0.1), 12 * np.log(0.4)], 10)
    features_N_3 = np.column_stack([np.zeros(20), np.zeros(20), log_determinant_N])
    explainer._classifier.fit(features_N_3, np.repeat(["noise", "pose"], 10))
    assert explainer.rules() == [
        "deviation of the poses <= 0.2: noise (100%)",
        "deviation of the poses > 0.2: pose (100%)",
    ]


@pytest.mark.parametrize(("depth", "most"), [(1, 2), (2, 4), (3, 8)])
def test_there_are_no_more_rules_than_the_depth_allows(depth, most):
    random = np.random.default_rng(1)
    explainer = ResidualRules("tiny", 0, depth=depth)
    explainer._classifier.fit(random.normal(size=(300, 3)), random.choice(["noise", "pose", "overlap"], 300))
    assert 2 <= len(explainer.rules()) <= most


def test_it_reads_the_observed_pair_alone_so_that_controls_can_run_it():
    entry = explainer_entry("residuals_rules")
    assert entry.observed_only
    assert not entry.oracle


@pytest.mark.parametrize("wrong", [{"depth": 0}, {"smallest_leaf": 0.6}, {"smallest_leaf": 0}, {"leaves": 3}])
def test_a_tree_that_cannot_be_is_refused(wrong):
    with pytest.raises(InputError, match="setting"):
        require_settings("residuals_rules", wrong)
