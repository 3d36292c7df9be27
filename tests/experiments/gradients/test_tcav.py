from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from gpca.experiments.gradients.settings import GradientSettings
from gpca.experiments.gradients.tcav import ONE_OBJECT, concept_examples, tcav, two_sided_p
from gpca.pairs.perturbation import CONCEPTS

WEIGHTS = torch.eye(3, 8, dtype=torch.float64)
LINEAR = SimpleNamespace(classes=CONCEPTS, mean_logits=lambda h_N_d: (h_N_d - 0.1 * h_N_d.square()) @ WEIGHTS.T)


@pytest.fixture(scope="module")
def embedded(registrations):
    """Each concept has an axis of its own, and the object one that no class looks at."""
    random = np.random.default_rng(0)
    h_S_8 = 0.5 * random.normal(size=(len(registrations), 8))
    for axis, concept in enumerate(CONCEPTS):
        h_S_8[registrations.concept == concept, axis] += 2
    h_S_8[:, 4] += 2 * (registrations.object_name == "brick")
    return replace(registrations, attached={"embedding": h_S_8.astype(np.float32)})


@pytest.fixture(scope="module")
def found(embedded):
    train, test = (embedded.subset(embedded.rows(split)) for split in ("train", "test"))
    rows = tcav(LINEAR, train, test, GradientSettings(vectors=15), "tiny", 0)
    return {(row["tested"], row["concept"]): row for _, row in rows.iterrows()}


@pytest.mark.parametrize("concept", CONCEPTS)
def test_a_class_grows_along_its_own_concept_and_significantly_so(found, concept):
    row = found[concept, concept]
    assert row["score"] == 1
    assert 0.2 < row["chance"] < 0.8
    assert row["significant"] == 1 and row["p"] < 0.05 / 12
    assert row["probe"] > 0.8


def test_a_class_falls_along_the_others(found):
    assert found["noise", "pose"]["score"] < 0.2


def test_every_concept_is_tested_for_every_class_and_one_object_too(found):
    assert set(found) == {(tested, concept) for tested in (*CONCEPTS, ONE_OBJECT) for concept in CONCEPTS}


def test_a_concept_of_too_few_samples_is_left_out(embedded):
    few = embedded.subset(np.flatnonzero(embedded.concept != "pose"))
    assert list(concept_examples(few, CONCEPTS)) == ["noise", "overlap", ONE_OBJECT]
    assert ONE_OBJECT not in concept_examples(embedded.subset(np.flatnonzero(embedded.object_name == "cone")), CONCEPTS)


def test_the_test_is_welchs_and_says_0_or_1_where_nothing_varies():
    from scipy.stats import ttest_ind

    one, other = [0.1, 0.5, 0.4], [0.7, 0.9, 0.6, 0.8]
    assert two_sided_p(one, other) == pytest.approx(ttest_ind(one, other, equal_var=False).pvalue)
    assert two_sided_p([1, 1], [1, 1]) == 1
    assert two_sided_p([1, 1], [0, 0]) == 0
