import numpy as np
import pytest

from gpca.active_learning.rounds import Embedded, NewConceptTrial, answers, run_trial
from gpca.active_learning.settings import NEW_CONCEPT_STRATEGIES, ActiveLearningSettings, NewConceptSettings
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError

CLASSES = ("nominal", "noise", "pose", "overlap", "geometry")
SETTINGS = ActiveLearningSettings(
    initial=16, labels=8, batch=4, gpc=GPCSettings(learning_rate=0.05, iterations=30, inducing=12, draws=50)
)


@pytest.fixture(scope="module")
def samples():
    """Five clusters, of which the last has few samples."""
    random = np.random.default_rng(0)
    counts = [12, 12, 12, 12, 6]
    concept_S = np.repeat(CLASSES, counts)
    centers = 4 * np.repeat(np.eye(5, 8), counts, axis=0)
    splits = np.concatenate([np.where(np.arange(count) % 3 == 0, "test", "train") for count in counts])
    return Embedded(centers + random.normal(scale=0.5, size=(54, 8)), concept_S, splits)


@pytest.fixture(scope="module")
def curves(samples):
    experiment = NewConceptTrial("pair", samples, "geometry", CLASSES, errors=(0.25,))
    found = run_trial(experiment, NEW_CONCEPT_STRATEGIES, SETTINGS, "tiny", 0)
    return {(setting, strategy): curve for setting, strategy, curve in found}


def test_every_strategy_learns_from_every_oracle_and_all_labels_are_right(curves):
    assert list(curves) == [
        *(("pair", strategy) for strategy in NEW_CONCEPT_STRATEGIES),
        *(("pair_errors_25", strategy) for strategy in NEW_CONCEPT_STRATEGIES[:2]),
    ]


def test_all_start_from_the_same_samples_and_know_nothing_of_the_new_concept(curves):
    assert {(curve[0]["accuracy"], curve[0]["accuracy_new"]) for curve in curves.values()} == {(16 / 18, 0)}


def test_the_new_concept_is_learned_with_all_labels_at_once(curves):
    labels = [step["labels"] for step in curves["pair", "all_labels"]]
    assert labels == [0, 36 - 16]
    assert curves["pair", "all_labels"][-1]["accuracy_new"] == 1


def test_wrong_answers_are_learned_and_counted_by_what_is_true(samples, curves):
    experiment = NewConceptTrial("pair", samples, "geometry", CLASSES, errors=(0.9,))
    [*_, (setting, _, wrong)] = run_trial(experiment, ["random"], SETTINGS, "tiny", 0)
    assert setting == "pair_errors_90"
    right = curves["pair", "random"]
    assert [step["new_labels"] for step in wrong] == [step["new_labels"] for step in right]
    assert wrong[-1]["accuracy"] < right[-1]["accuracy"]


def test_samples_follow_each_other(samples):
    both = samples.followed_by(samples)
    assert len(both.concept) == 108
    assert both.rows("test").tolist() == [*samples.rows("test"), *(samples.rows("test") + 54)]


def test_embeddings_with_an_erring_oracle_are_among_those_that_are_tried():
    with pytest.raises(InputError, match="erring of new_concepts: 'pair' is not among the embeddings; choose from oth"):
        NewConceptSettings(embeddings=("other_samples",), erring=("pair",))


# The oracle

NAMED = ("noise", "pose", "overlap", "geometry")


@pytest.fixture(scope="module")
def truth():
    return np.random.default_rng(0).choice(["noise", "pose", "overlap"], 200)


@pytest.mark.parametrize(("share", "wrong"), [(0.0, 0), (0.05, 10), (0.3, 60), (0.999, 200)])
def test_that_share_of_the_answers_is_wrong(truth, share, wrong):
    named = answers(truth, NAMED, share, "tiny", 0)
    assert np.sum(named != truth) == wrong
    assert set(named.tolist()) <= set(NAMED)


def test_every_other_concept_is_named_by_mistake(truth):
    named = answers(truth, NAMED, 0.999, "tiny", 0)
    assert set(named[truth == "pose"].tolist()) == {"noise", "overlap", "geometry"}


def test_a_worse_oracle_repeats_the_errors_of_a_better_one(truth):
    better, worse = (answers(truth, NAMED, share, "tiny", 0) for share in (0.1, 0.3))
    wrong = better != truth
    assert np.array_equal(better[wrong], worse[wrong])


def test_errors_are_named_by_the_axes(truth):
    first, again, other = (answers(truth, NAMED, 0.2, "tiny", seed) for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
