from collections import Counter

import numpy as np
import pytest

from gpca.causes import drawing
from gpca.causes.candidate import Registrar, Unmeasurable
from gpca.causes.drawing import Quotas, Tally, draw_causes, group_of
from gpca.causes.settings import CauseSettings, Shares
from gpca.causes.truth import Truth
from gpca.errors import InputError
from gpca.rigid import inverse, rotation_angle_rad, transform
from gpca.uncertainty.settings import FEWEST_STARTS

from ..conftest import FEW_CAUSES as FEW


def groups(causes, split):
    truth = causes.truth
    return Counter(group_of(truth.subset(np.array([row]))) for row in causes.rows(split))


@pytest.mark.parametrize(("split", "states"), [("train", (4, 2, 6)), ("test", (2, 1, 5))])
def test_every_group_has_its_share(causes, split, states):
    truth = causes.truth.subset(causes.rows(split))
    assert tuple((truth.state == state).sum() for state in ("nominal", "borderline", "failed")) == states
    for concept in ("noise", "pose", "overlap"):
        found = groups(causes, split)
        assert abs(found[concept, True] + found[concept, False] - states[2] / 3) < 1
    assert (causes.registrations.concept == np.array(["noise", "pose", "overlap"])[causes.truth.phi.argmax(1)]).all()


def test_a_cause_that_was_not_applied_has_no_part_and_training_and_testing_share_no_object(causes):
    assert (causes.truth.phi[~causes.applied] == 0).all()
    shown = {split: set(causes.registrations.object_name[causes.rows(split)].tolist()) for split in ("train", "test")}
    assert not shown["train"] & shown["test"]


def test_refused_candidates_are_counted(drawn):
    causes, tally, seconds = drawn
    for split in ("train", "test"):
        of_split = {key: count for key, count in tally.items() if key[0] == split}
        assert sum(of_split.values()) == causes.candidate[causes.rows(split)].max() + 1
        kept = Counter({key[2:4]: 0 for key in of_split})
        kept.update({(group, several): 0 for *_, group, several, _ in of_split})
        for (_, _, group, several, was_kept), count in of_split.items():
            kept[group, several] += count * was_kept
        assert +kept == +groups(causes, split)
    assert (seconds > 0).all()


def test_poses_are_those_of_what_was_observed(causes):
    """The source lies where ICP put it; where the truth puts it, it lies on the model."""
    registrations = causes.registrations
    runs = causes.T_target_source_runs
    assert runs.shape[1] == FEWEST_STARTS
    assert np.array_equal(runs[:, 0], registrations.T_target_source_icp)
    for row in np.flatnonzero(~causes.applied[:, 0] & (causes.truth.error[:, -1] < 0.02)):
        true, icp = (registrations.T_target_source(which, row) for which in ("true", "icp"))
        right = transform(true @ inverse(icp), registrations.cloud(row).astype(float))
        target = registrations.target(row)
        nearest = np.linalg.norm(right[:, None] - target, axis=2).min(axis=1)
        assert np.median(nearest) < 0.07  # half the spacing of the model's points
    turned_S = np.array([rotation_angle_rad(T) for T in registrations.T_target_source_true])
    assert (turned_S > 0).all()  # every start is off
    assert ((turned_S > np.deg2rad(5) + 1e-9) == causes.applied[:, 1]).all()


def test_other_starts_measure_nearly_the_same(causes):
    tested = causes.truth.subset(causes.rows("test"))
    assert len(causes.truth_again) == len(tested)
    assert not np.array_equal(causes.truth_again.error, tested.error)
    assert np.corrcoef(causes.truth_again.error[:, -1], tested.error[:, -1])[0, 1] > 0.9


def test_a_candidate_does_not_depend_on_how_many_are_wanted(four, causes):
    fewer, _, _ = draw_causes(four, "four", 100, CauseSettings(**FEW | {"test": 6}))
    shared = set(fewer.candidate[fewer.rows("test")]) & set(causes.candidate[causes.rows("test")])
    assert len(shared) >= 3
    for number in shared:
        one, other = (
            next(row for row in drawn.rows("test") if drawn.candidate[row] == number) for drawn in (fewer, causes)
        )
        assert np.array_equal(fewer.registrations.cloud(one), causes.registrations.cloud(other))
        assert np.array_equal(fewer.truth.error[one], causes.truth.error[other])


def test_a_candidate_without_a_truth_is_counted_and_lost_to_no_quota(four, monkeypatch):
    def run(self, causes, xi_n_6, original=Registrar.run):
        if (xi_n_6[0] == 0).all() and next(faults, False):  # an observed run, when the truth is known
            raise Unmeasurable("no correspondences")
        return original(self, causes, xi_n_6)

    faults = iter([True, True])
    monkeypatch.setattr(Registrar, "run", run)
    causes, tally, _ = draw_causes(four, "four", 100, CauseSettings(**FEW))
    assert len(causes) == FEW["train"] + FEW["test"]
    assert sum(count for key, count in tally.items() if key[2] == "no correspondences") >= 2


def test_symmetric_objects_are_judged_by_the_shape(four, monkeypatch):
    monkeypatch.setattr("gpca.causes.measuring.PoseErrors", lambda points, judged, symmetric: symmetric)
    subjects = drawing.read_subjects(four)
    assert [subject.errors for subject in subjects] == [subject.symmetric for subject in subjects]
    assert [subject.symmetric for subject in subjects] == [True, False, False, False]


def test_a_single_object_is_refused(four):
    one = four.subset(np.array([2]))
    with pytest.raises(InputError, match="causes of one: has objects of one family alone, which cannot be split"):
        draw_causes(one, "one", 100, CauseSettings(**FEW))


def test_the_error_shown_is_that_of_the_first_run(causes, subjects):
    registrations, of_index = causes.registrations, {subject.index: subject for subject in subjects}
    for row in range(len(causes)):
        subject = of_index[int(registrations.object_index[row])]
        T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
        expected = min(subject.errors((T_true @ inverse(T_icp))[None])[0], 0.5)
        assert causes.error_shown[row] == pytest.approx(expected, abs=2e-3)


BOTH, NEITHER = np.array([True, False, True]), np.zeros(3, bool)
LIMITS = {"nominal_limit": 0.02, "failed_limit": 0.03, "cause_limit": 0.01, "uncertainty_limit": 5.0}


def quotas(total=100, **settings):
    return Quotas(total, CauseSettings(**settings))


def fill(quotas, *groups):
    for group in groups:
        while quotas.wants(group):
            quotas.taken[group] += 1


@pytest.mark.parametrize("order", [(False, True), (True, False)])
def test_a_split_is_full_when_every_group_is(order):
    wanted = quotas()
    for name, count in {"nominal": 30, "borderline": 16, "noise": 18, "pose": 18, "overlap": 18}.items():
        taken = dict.fromkeys(order, 0)
        for several in order:
            while wanted.wants((name, several)):
                assert not wanted.all_filled()
                wanted.taken[name, several] += 1
                taken[several] += 1
        # Whichever kind comes first leaves room for three tenths of the other.
        if name in ("noise", "pose", "overlap"):
            assert list(taken.values()) == [13, 5]
        assert sum(taken.values()) == count
    assert not wanted.wants(("geometry", False))
    assert wanted.all_filled()


def test_a_candidate_is_wanted_as_long_as_it_can_be():
    wanted = quotas()
    assert wanted.wants_applied(NEITHER)
    fill(wanted, ("nominal", False), ("borderline", False))
    assert not wanted.wants_applied(NEITHER)  # without causes it is neither of the failed
    assert wanted.wants_state("failed", BOTH)
    fill(wanted, ("noise", False), ("noise", True), ("overlap", False))
    assert wanted.wants_state("failed", BOTH)  # by overlap among several
    assert not wanted.wants_state("failed", BOTH, np.array([True, True, False]))  # which is not accepted
    assert not wanted.wants_state("failed", np.array([False, False, True]))  # it has but one cause
    fill(wanted, ("overlap", True))
    assert not wanted.wants_applied(BOTH)
    assert wanted.wants_applied(np.array([False, True, False]))


def test_what_is_off_when_clean_is_wanted_only_where_it_has_a_share():
    assert not quotas().wants_state("geometry", BOTH)
    assert quotas(shares=Shares(nominal=0.2, geometry=0.1)).wants_state("geometry", NEITHER)


@pytest.mark.parametrize(
    ("rare", "said"),
    [
        (["noise"], "failed from noise; change causes.severities"),
        (["pose", False], "samples that failed from pose alone; "),
        (["overlap", True], "failed from overlap among several causes; "),
        (["nominal"], "nominal samples; "),
        (["borderline"], "borderline samples; change causes.severities"),
    ],
)
def test_who_gives_up_says_which_group_is_rare_and_what_to_widen(rare, said):
    wanted = quotas()
    fill(wanted, *(group for group in wanted._most if list(group)[: len(rare)] != rare))
    line = str(wanted.refuse_to_go_on("ycb", 3, "train", 2000))
    assert line.startswith("causes of ycb, seed 3, train: 2000 candidates yielded ")
    assert said in line


def test_the_group_of_a_failed_sample_has_its_cause():
    def error(none, *parts):
        return [[none + sum(part for i, part in enumerate(parts) if subset >> i & 1) for subset in range(8)]]

    def group(rows):
        return group_of(Truth(np.array(rows), np.zeros((1, 8)), **LIMITS))

    assert group(error(0.01, 0.0, 0.2, 0.05)) == ("pose", True)
    assert group(error(0.01, 0.0, 0.2, 0.005)) == ("pose", False)
    assert group(error(0.01, 0.015, 0.0, 0.0)) == ("borderline", False)
    assert group(error(0.01, 0.005, 0.0, 0.0)) == ("nominal", False)
    assert group(error(0.025, 0.2, 0.0, 0.0)) == ("geometry", False)


def test_the_tally_says_what_became_of_every_candidate(tmp_path):
    tally = Tally()
    for kept in (True, False, False):
        tally["train", "cup", "pose", True, kept] += 1
    tally["test", "mug", "no correspondences", False, False] += 1
    tally.save(tmp_path / "tally.csv")
    head, *lines = (tmp_path / "tally.csv").read_text().splitlines()
    assert head == "split,object,group,several,kept,refused"
    assert lines == ["test,mug,no correspondences,0,0,1", "train,cup,pose,1,1,2"]
