"""Limits that a user's labeled registrations set: what they promise, what they lack, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.model.calibration import LabeledRegistrations
from gpca.model.diagnoser import Diagnoser
from gpca.model.explainer import Explainer
from gpca.model.file import Model
from gpca.model.result import level_at

from .test_diagnoser import FAILED

SHARES = [0.02, 0.04] * 20


def labeled(n, tolerance=0.03, **options):
    """Registrations, half of them right, whose probabilities of being wrong overlap."""
    random = np.random.default_rng(n)
    labels = ["right", "wrong"] * (n // 2)
    results = np.clip(random.normal(np.tile([0.4, 0.7], n // 2), 0.15), 0, 1)
    diagnoses = [
        replace(FAILED, result=float(result), unlikeness=number / n, tolerance_share=tolerance)
        for number, result in enumerate(results)
    ]
    return LabeledRegistrations.of(diagnoses, options.pop("labels", labels), **options)


def test_what_is_promised_holds_of_the_labeled_and_no_state_contradicts_the_alarm():
    given = labeled(200)
    [level] = given.levels()
    guarantee, right_N = level.guarantee, given.label_N == "right"
    assert (guarantee.labeled, guarantee.samples, guarantee.families) == (True, 200, 0)
    result_N = np.array([diagnosis.result for diagnosis in given.diagnoses])
    call_N = guarantee.alarm(result_N)
    assert 0.02 < (call_N[~right_N] == "good").mean() <= 0.05 and 0.02 < (call_N[right_N] == "failed").mean() <= 0.05
    assert (call_N == "not sure").any()
    state_N = np.where(result_N < level.threshold, "good", "failed")
    assert set(zip(call_N, state_N, strict=True)) == {
        ("good", "good"), ("failed", "failed"), ("not sure", "good"), ("not sure", "failed"),
    }  # fmt: skip
    inside_N_2 = guarantee.sets(np.column_stack([1 - result_N, result_N]))
    assert 0.9 <= np.where(right_N, *inside_N_2.T).mean() < 0.93
    promised = [line.split(":")[0] for line in given.report()][1:]
    assert promised == [f"{of:10}promised" for of in ("missed", "alarms", "sets")]


def test_what_is_missing_is_counted_for_each_risk():
    head, missed, alarms, sets = labeled(22, risk=0.1).report()
    assert head == "labeled   11 right and 11 wrong, within 3 % of the diameter"
    assert (missed.split(":")[0], alarms.split(":")[0]) == ("missed    promised", "alarms    promised")
    causes = ["right", "pose"] * 2 + ["right"] * 3
    head, missed, alarms, sets = LabeledRegistrations.of(
        [replace(FAILED, result=0.1 * number) for number in range(7)], causes, list("aabbcde")
    ).report()
    assert head.startswith("labeled   5 right and 2 wrong in 5 groups")
    assert missed == "missed    not yet: at most 5% of failures are called good; label 17 more groups with wrong ones"
    promise = "at most 5% of good ones are called failed"
    assert alarms == f"alarms    not yet: {promise}; label 14 more groups with right ones"
    assert sets == "sets      not yet: at least 90% of the sets contain the true state; label 4 more groups"
    [level] = labeled(10).levels()
    assert set(level.guarantee.alarm(np.array([0.0, 0.5, 1.0]))) == {"not sure"}


def test_only_what_a_user_labeled_is_promised_at_the_tolerances_of_the_labels(model, tmp_path):
    diagnoser = labeled(60, 0.02).set_in(model.diagnoser)
    assert [level.tolerance for level in diagnoser.levels] == [0.02]
    two = labeled(60, 0.05).set_in(diagnoser)
    assert [level.tolerance for level in two.levels] == [0.02, 0.05]
    assert level_at(two.levels, 0.03).guarantee.labeled
    named = labeled(60, 0.05, labels=["right", "noise", "right", "pose"] * 15).set_in(diagnoser)
    assert level_at(named.levels, 0.03).guarantee is None  # sets of other states
    again = labeled(80, 0.02).set_in(two)
    assert [level.guarantee.samples for level in again.levels] == [80, 60]
    shares = [
        replace(diagnosis, tolerance_share=share)
        for diagnosis, share in zip(labeled(40).diagnoses, SHARES, strict=True)
    ]
    spread = LabeledRegistrations.of(shares, ["right", "wrong"] * 20).levels()
    assert [level.tolerance for level in spread] == [0.02, 0.04] and spread[0].guarantee == spread[1].guarantee
    replace(model, diagnoser=named).save(tmp_path / "mine.pt")
    read = Model.load(tmp_path / "mine.pt")
    assert read.diagnoser.levels == named.levels
    assert read.learning.endswith("; calibrated on 60 labeled registrations")
    assert Diagnoser.from_state(model.diagnoser.state()).levels[0].guarantee.labeled is False


def test_an_answer_says_whose_promise_it_is(explainer, pair):
    source, target = pair
    explanations = [explainer.explain(source[start:], target) for start in range(8)]
    for groups, words in (
        (None, "on 8 labeled registrations, for others like these"),
        (list("aabbccdd"), "of 4 groups"),
    ):
        mine = explainer.calibrated(explanations, ["right", "wrong"] * 4, groups)
        assert isinstance(mine, Explainer)
        said = mine.explain(source, target)
        assert said.diagnosis.guarantee.call == "not sure" and said.diagnosis.guarantee.labeled
        assert words in said.text() and words in said.html()
        assert "probably" in said.text().split("\n")[len(said.warnings)] and "This registration probably" in said.html()
        assert "labeled registrations" not in mine.explain(source, target, tolerance="9%").text()


@pytest.mark.parametrize(
    ("labels", "groups", "words"),
    [
        (["right"] * 4, None, "labels: are all right; label some that are right and some that are wrong"),
        (["right", "bad", "", "pose"], None, "registration 1: has the label 'bad'; choose one of right, wrong, noise"),
        (["right", "wrong"], None, "labels: are not one for each of 4 registrations"),
        (["right", "wrong"] * 2, ["a", "b", "", "c"], "registration 2: has no group"),
        (["right", "wrong", "right", "right"], None, "registration 3: is the registration of registration 0"),
        (
            ["right", "wrong", "right", "wrong"],
            None,
            "registration 3: is 'wrong' and contradicts 'right' of registration 0",
        ),
    ],
)
def test_labels_that_promise_nothing_are_refused(labels, groups, words):
    diagnoses = [replace(FAILED, result=result) for result in (0.1, 0.2, 0.3, 0.1)]
    with pytest.raises(InputError, match=f"^{words}"):
        LabeledRegistrations.of(diagnoses, labels, groups)


def test_registrations_of_unknown_state_are_left_out_and_counted():
    diagnoses = [replace(FAILED, result=0.1 * number, void=number < 2) for number in range(6)]
    given = LabeledRegistrations.of(diagnoses, ["right", "wrong"] * 3)
    assert len(given.diagnoses) == 4 and next(given.report()).endswith("; 2 of unknown state are left out")
    with pytest.raises(InputError, match="with a known state are not both right and wrong"):
        LabeledRegistrations.of(diagnoses[:3], ["right", "wrong", "right"])
