"""What is calibrated on what, and how often promises are kept."""

from dataclasses import replace

import numpy as np
import pytest

import gpca.guarantee.answers as module
from gpca.causes.truth import NOMINAL
from gpca.errors import InputError
from gpca.evaluation.conformal import ALARM, GOOD, NOT_SURE
from gpca.guarantee.guarantee import STATES
from tests.guarantee.scored import scored_samples

SETTINGS = module.GuaranteeSettings(level=0.8)


@pytest.fixture(scope="module")
def scored():
    return scored_samples()


@pytest.fixture(scope="module")
def promised(scored):
    [condition] = [each for each in module.conditions(scored) if each.name == module.FAMILIES]
    return condition


@pytest.fixture(scope="module")
def answers(scored, promised):
    return module.answers_of(scored, promised, SETTINGS)


def test_every_sample_of_a_family_that_a_model_did_not_learn_from_is_answered_once(scored, promised, answers):
    assert sorted(answers.row) == np.flatnonzero(promised.tested).tolist()
    assert not scored.seen[answers.row].any()
    assert answers.families == 7  # two thirds of twelve, without the tested one
    assert set(answers.sets) == {module.PLAIN, module.BY_SAMPLE, module.BY_STATE, module.BY_FAMILY}
    assert set(answers.calls) == {module.PLAIN, module.BY_SAMPLE, module.BY_FAMILY}


def test_neither_the_tested_family_nor_what_was_learned_from_sets_a_threshold(scored, promised, answers):
    own = scored.family == "family04"
    turned = own & (np.arange(len(scored)) % 2 == 0)
    asked = own[answers.row] & ~turned[answers.row]
    for changed, same in ((turned | scored.seen, True), (~own & ~scored.seen, False)):
        scores = np.where(changed[:, None], scored.scores[:, ::-1], scored.scores)
        again = module.answers_of(replace(scored, scores=scores), promised, SETTINGS)
        for name in (module.BY_SAMPLE, module.BY_STATE, module.BY_FAMILY):
            assert np.array_equal(again.sets[name][asked], answers.sets[name][asked]) == same


def test_promises_by_sample_are_kept_about_as_well_as_families_are_alike(scored, answers):
    state = scored.state[answers.row]
    truth = state[:, None] == np.array(STATES)
    for name in (module.BY_SAMPLE, module.BY_STATE, module.BY_FAMILY):
        assert (answers.sets[name] & truth).any(axis=1).mean() > 0.76
    calls = answers.calls[module.BY_SAMPLE]
    assert (calls[state != NOMINAL] == GOOD).mean() < 0.07
    assert (calls[state == NOMINAL] == ALARM).mean() < 0.07
    assert set(answers.calls[module.BY_FAMILY]) == {NOT_SURE}  # seven families promise at most 1 in 8
    assert NOT_SURE not in answers.calls[module.PLAIN]


def test_conditions_of_shift_calibrate_on_one_kind_and_test_the_other(scored):
    found = {condition.name: condition for condition in module.conditions(scored)}
    assert list(found) == [module.FAMILIES, "from_cups", "from_tools", "milder", "harder", "frames"]
    for name, condition in found.items():
        assert not (condition.calibration & condition.tested).any() or name == module.FAMILIES
        assert not (scored.seen & condition.calibration).any() or name == "frames"
    assert set(scored.source[found["from_cups"].calibration]) == {"cups"}
    assert set(scored.source[found["frames"].tested]) == {"real_rgbd"}
    severity = scored.severity
    nominal = scored.state == NOMINAL
    for of_state in (nominal, ~nominal):
        mild, hard = (severity[found["milder"].calibration & of_state], severity[found["milder"].tested & of_state])
        assert mild.max() <= hard.min() and abs(len(mild) - len(hard)) <= 1
    one = scored.subset((scored.source == "cups") & np.char.startswith(scored.model, "part"))
    assert [condition.name for condition in module.conditions(one)] == [module.FAMILIES, "milder", "harder"]


def test_plain_sets_and_the_plain_threshold_by_hand():
    probabilities = np.array([[0.5, 0.3, 0.1, 0.1, 0.0], [0.95, 0.05, 0, 0, 0], [0.2, 0.2, 0.2, 0.2, 0.2]])
    assert module.plain_sets(probabilities, 0.8).sum(axis=1).tolist() == [2, 1, 4]
    assert module.plain_sets(probabilities, 0.9).sum(axis=1).tolist() == [3, 1, 5]
    failure = np.arange(100.0)
    assert module.plain_threshold(failure, 0.05) == 5 and module.plain_threshold(failure[:1], 0.99) == 0


def test_scores_survive_the_file(scored, tmp_path):
    scored.save(tmp_path / "mine.csv")
    read = module.Scored.load(tmp_path / "mine.csv")
    assert read.family.tolist() == scored.family.tolist() and read.seen.tolist() == scored.seen.tolist()
    assert np.abs(read.scores - scored.scores).max() < 1e-6
    (tmp_path / "spoiled.csv").write_text((tmp_path / "mine.csv").read_text().replace(",several,", ",sundry,"))
    with pytest.raises(InputError, match="unknown state 'sundry'; its states are nominal, noise"):
        module.Scored.load(tmp_path / "spoiled.csv")
