from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.pose_error import PoseErrors
from gpca.alignment.rigid import inverse, rotation_angle_rad, transform
from gpca.causes import drawing
from gpca.causes.candidate import Registrar, Unmeasurable
from gpca.causes.drawing import draw_causes, draw_geometry, group_of
from gpca.causes.settings import CauseSettings, CauseSeverities, Limits
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
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


def test_a_cause_that_was_not_applied_has_no_part(causes):
    assert (causes.truth.phi[~causes.applied] == 0).all()


def test_training_and_testing_share_no_object(causes):
    shown = {split: set(causes.registrations.object_name[causes.rows(split)].tolist()) for split in ("train", "test")}
    assert not shown["train"] & shown["test"]


def test_refused_candidates_are_counted(drawn):
    causes, tally, seconds = drawn
    for split in ("train", "test"):
        of_split = {key: count for key, count in tally._counts.items() if key[0] == split}
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


def test_a_group_that_cannot_be_filled_ends_with_a_line(four):
    weak = CauseSeverities(noise=(0, 0), outliers=(0, 0))
    message = "causes of four, seed 100, train: 120 candidates yielded 0 of 2 samples that failed from noise; raise"
    with pytest.raises(InputError, match=message):
        draw_causes(four, "four", 100, CauseSettings(**FEW, severities=weak, candidates=10))


def test_a_candidate_without_a_truth_is_counted_and_lost_to_no_quota(four, monkeypatch):
    def run(self, causes, xi_n_6, original=Registrar.run):
        if (xi_n_6[0] == 0).all() and next(faults, False):  # an observed run, when the truth is known
            raise Unmeasurable("no correspondences")
        return original(self, causes, xi_n_6)

    faults = iter([True, True])
    monkeypatch.setattr(Registrar, "run", run)
    causes, tally, _ = draw_causes(four, "four", 100, CauseSettings(**FEW))
    assert len(causes) == FEW["train"] + FEW["test"]
    assert sum(count for key, count in tally._counts.items() if key[2] == "no correspondences") >= 2


def test_symmetric_objects_are_judged_by_the_shape(four, monkeypatch):
    seen = {}

    def errors(points, judged, symmetric):
        seen[len(seen)] = symmetric
        return PoseErrors(points, judged, symmetric)

    monkeypatch.setattr("gpca.causes.measuring.PoseErrors", errors)
    subjects = drawing.read_subjects(four)
    assert list(seen.values()) == [subject.symmetric for subject in subjects] == [True, False, False, False]


def test_a_single_object_is_refused(four):
    one = replace(four, names=four.names[2:3], diameters_m=four.diameters_m[2:3], clouds=four.clouds[2:3])
    assert isinstance(one, ObjectClouds)
    with pytest.raises(InputError, match="causes of one: has objects of one family alone, which cannot be split"):
        draw_causes(one, "one", 100, CauseSettings(**FEW))


def test_a_method_that_needs_normals_is_refused(four):
    with pytest.raises(InputError, match="ICP method 'point_to_plane': the target has no normals; use point_to_point"):
        draw_causes(four, "four", 100, CauseSettings.from_dict(FEW, {"method": "point_to_plane"}))


def test_what_fails_without_a_cause_is_drawn_of_other_objects_for_each_split(four):
    often = CauseSettings(**FEW, limits=Limits(nominal=0.012, failed=0.014))
    geometry = draw_geometry(four, "four", 100, often, {"train": 3, "test": 2}, 60)
    assert [len(geometry.rows(split)) for split in ("train", "test")] == [3, 2]
    assert not geometry.applied.any()
    assert (geometry.truth.error[:, 0] >= 0.014).all()
    assert set(geometry.truth.dominant.tolist()) == {"geometry"}
    shown = [set(geometry.registrations.object_name[geometry.rows(split)].tolist()) for split in ("train", "test")]
    assert not shown[0] & shown[1]


def test_where_nothing_fails_without_a_cause_there_is_nothing(four):
    assert draw_geometry(four, "four", 100, CauseSettings(**FEW), {"train": 3, "test": 2}, 4) is None


def test_the_error_shown_is_that_of_the_first_run(causes, subjects):
    registrations, of_index = causes.registrations, {subject.index: subject for subject in subjects}
    for row in range(len(causes)):
        subject = of_index[int(registrations.object_index[row])]
        T_icp, T_true = (registrations.T_target_source(which, row) for which in ("icp", "true"))
        expected = min(subject.errors((T_true @ inverse(T_icp))[None])[0], 0.5)
        assert causes.error_shown[row] == pytest.approx(expected, abs=2e-3)
