"""The guarantee as a whole: the states, calibration on families, and its plain form in a file."""

import json

import numpy as np
import pytest

from gpca.causes.dataset import labels_of
from gpca.causes.truth import BORDERLINE, Truth
from gpca.errors import InputError
from gpca.evaluation.conformal import OUTCOMES
from gpca.guarantee.guarantee import SEVERAL, STATES, Guarantee, calibrate, state_scores, states_of


def drawn(random, samples):
    """Scores, states and families of samples, some of them borderline."""
    number_N = random.integers(len(STATES), size=samples)
    scores = np.exp(2 * np.eye(len(STATES))[number_N] + random.normal(size=(samples, len(STATES))))
    state_N = np.array(STATES, dtype=object)[number_N]
    state_N[:: samples // 10] = BORDERLINE
    family_N = random.integers(12, size=samples).astype(str)
    return scores / scores.sum(axis=1, keepdims=True), state_N.astype(str), family_N


def test_states_and_their_scores_are_those_of_labels_but_for_several_causes():
    worth = {"nominal": [0, 0.001, 0.002, 0.003], "noise": [0, 0.1, 0.002, 0.1], "several": [0, 0.1, 0.1, 0.2]}
    # subsets of noise and pose; overlap adds nothing
    error = np.array([[*of, *of] for of in worth.values()])
    truth = Truth(error, np.zeros((3, 8)), 0.02, 0.03, 0.01, 1.0)
    assert states_of(truth).tolist() == list(worth)
    assert labels_of(truth)[2] != SEVERAL
    between = Truth(np.full((1, 8), 0.025), np.zeros((1, 8)), 0.02, 0.03, 0.01, 1.0)
    assert states_of(between).tolist() == [BORDERLINE]
    scores = state_scores(np.array([[0.2, 0.8, 0, 0], [0.0, 0.5, 0.5, 0], [1.2, 0, 0, 0], [0.4, 0.9, 0.9, -1.0]]))
    assert scores[:2] == pytest.approx(np.array([[0.2, 0.8, 0, 0, 0], [0, 0.25, 0.25, 0, 0.5]]))
    assert scores[2, 0] == 1 and scores[3] == pytest.approx([0.4, 0.15, 0.15, 0, 0.3])
    assert scores.sum(axis=1) == pytest.approx(1)
    with pytest.raises(InputError, match=r"scores: have the shape .* or are not finite; give a finite number for each"):
        state_scores(np.array([[np.nan, 0, 0, 0]]))


@pytest.mark.parametrize("choice", [{}, {"by_state": True}])
def test_the_plain_form_is_read_back_as_it_was(choice):
    scores, state, family = drawn(np.random.default_rng(7), 400)
    guarantee = calibrate(scores, state, family, **choice)
    plain = json.loads(json.dumps(guarantee.to_dict()))
    assert Guarantee.from_dict(plain) == guarantee
    assert guarantee.sets(scores).shape == scores.shape and set(guarantee.alarm(1 - scores[:, 0])) <= set(OUTCOMES)
    assert guarantee.samples == 390 and guarantee.families == 12


def test_borderline_samples_are_left_out_in_any_order_and_arrays_of_other_lengths_refused():
    scores, state, family = drawn(np.random.default_rng(8), 400)
    kept = state != BORDERLINE
    order = np.random.default_rng(9).permutation(400)
    expected = calibrate(scores[kept], state[kept], family[kept])
    assert calibrate(scores, state, family) == expected == calibrate(scores[order], state[order], family[order])
    scores, state, family = drawn(np.random.default_rng(11), 100)
    for arrays in ((scores[:50], state, family), (scores, state, family[:50])):
        with pytest.raises(InputError, match="have other numbers of scores, states and families; give one each"):
            calibrate(*arrays)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda plain: plain.pop("alarm"), "guarantee: is damaged .KeyError: 'alarm'.; calibrate it again"),
        (lambda plain: plain["sets"].update(limits=[1.0]), "guarantee: has not one limit for each state"),
        (lambda plain: plain["sets"].update(limits=["wide"]), "guarantee: is damaged .ValueError"),
        (lambda plain: plain["alarm"].update(colour="red"), "guarantee: is damaged .TypeError"),
        (
            lambda plain: plain["sets"].update(nonconformity="cumulative"),
            "guarantee: is damaged .ValueError: sets by cu",
        ),
    ],
)
def test_a_damaged_plain_form_is_one_line(spoil, message):
    scores, state, family = drawn(np.random.default_rng(10), 200)
    plain = calibrate(scores, state, family).to_dict()
    spoil(plain)
    with pytest.raises(InputError, match=message):
        Guarantee.from_dict(plain)
