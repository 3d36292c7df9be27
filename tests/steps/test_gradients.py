"""Saliency of points and its test by deletion; TCAV and its significance."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import make_model
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.gradients import (
    CENTER,
    GRADIENT,
    ONE_OBJECT,
    GradientSettings,
    chosen_rows,
    concept_examples,
    deletions,
    log_odds,
    orders,
    point_gradient,
    saliencies,
    tcav,
    two_sided_p,
)

ENCODING = EncoderSettings(draw_points=48, draws=1, options={"k": 6, "point_features": 8})


@pytest.fixture(scope="module")
def encoder():
    torch.manual_seed(0)
    return make_model(ENCODING).eval().encoder


@pytest.fixture(scope="module")
def gpc(encoder):
    random = np.random.default_rng(0)
    label_N = np.array(CONCEPTS)[np.arange(30) % 3]
    with torch.no_grad():
        h_N_d = encoder(torch.from_numpy(random.normal(size=(30, 48, 3)).astype(np.float32) / 3)).numpy()
    h_N_d += 3 * h_N_d.std() * random.normal(size=(3, h_N_d.shape[1]))[np.arange(30) % 3]
    return GPC(CONCEPTS, GPCSettings(learning_rate=0.1, iterations=20, inducing=6, draws=50), "tiny", 0).fit(
        h_N_d, label_N
    )


def test_the_differentiable_means_are_those_of_the_posterior(gpc):
    h_N_d = gpc.learned_N_d * gpc._scaler.scale_d + gpc._scaler.mean_d
    assert gpc.mean_logits(torch.from_numpy(h_N_d)).numpy() == pytest.approx(gpc.posterior(h_N_d)[0], abs=1e-4)


def test_log_odds_are_those_of_the_softmax():
    logits = torch.tensor([[1.0, 2.0, -1.0]], dtype=torch.float64)
    p = torch.softmax(logits, dim=1)[0, 1]
    assert log_odds(logits, 1).item() == pytest.approx(torch.log(p / (1 - p)).item())


def test_the_gradient_in_the_points_is_that_of_differences(encoder, gpc):
    cloud = torch.from_numpy(np.random.default_rng(1).normal(size=(1, 48, 3)).astype(np.float32) / 3)
    gradient = point_gradient(encoder, gpc, cloud, 2)
    largest = np.unravel_index(np.abs(gradient).argmax(), gradient.shape)

    def odds(step):
        moved = cloud.clone()
        moved[0, largest[0], largest[1]] += step
        with torch.no_grad():
            return log_odds(gpc.mean_logits(encoder(moved)), 2).item()

    assert (odds(1e-3) - odds(-1e-3)) / 2e-3 == pytest.approx(gradient[largest], rel=0.1)


def test_salient_is_a_long_gradient_or_what_a_way_to_the_center_lowers():
    points = np.array([[2.0, 0, 0], [-2, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 0]])
    gradient = np.array([[3.0, 0, 0], [1, 0, 0], [0, 0, 5], [0, -1, 0], [1, 1, 1]])
    found = saliencies(points, gradient)
    assert found[GRADIENT] == pytest.approx([3, 1, 5, 1, np.sqrt(3)])
    assert found[CENTER] == pytest.approx([12, -4, 0, 1, 0])


def test_the_orders_begin_with_the_most_and_with_the_least_salient():
    ways = orders({GRADIENT: np.array([1.0, 3, 2]), CENTER: np.array([0.0, -1, 1])}, "tiny", 0)
    assert [way.tolist() for way in ways["gradient"] + ways["to_centre"] + ways["least_gradient"]] == [
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
    ]
    assert all(sorted(way) == [0, 1, 2] for way in ways["random"])


def test_samples_are_balanced_and_of_the_test(registrations):
    rows = chosen_rows(registrations, 9)
    assert set(registrations.split[rows]) == {"test"}
    assert [int(np.sum(registrations.concept[rows] == concept)) for concept in CONCEPTS] == [3, 3, 3]
    assert len(chosen_rows(registrations, 3000)) == 18


def test_each_deletion_asks_again_and_repeats_to_the_byte(encoder, gpc, registrations):
    few = replace(registrations.subset(registrations.rows("test")[:6]), attached={})
    given = (encoder, gpc, few, "tiny", 0, ENCODING, GradientSettings(samples=3, deleted=(0.25, 0.5)))
    rows = deletions(*given)
    assert rows.equals(deletions(*given))
    assert len(rows) == 3 * 4 * 2
    assert (rows["before"] >= 1 / 3).all()
    assert rows["after"].nunique() > 6
    assert set(rows["named"]) <= set(CONCEPTS)
    assert rows["changed"].between(0, 1).all()


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


def test_every_concept_is_tested_for_every_class_and_one_object_too_and_a_class_falls_along_the_others(found):
    assert found["noise", "pose"]["score"] < 0.2
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
