import numpy as np
import pytest

from gpca.causes.drawing import Quotas, Tally, apportion, group_of
from gpca.causes.settings import CauseSettings, Shares
from gpca.causes.truth import Truth

BOTH, NEITHER = np.array([True, False, True]), np.zeros(3, bool)
LIMITS = {"nominal_limit": 0.02, "failed_limit": 0.03, "cause_limit": 0.01, "uncertainty_limit": 5.0}


def quotas(total=100, **settings):
    return Quotas(total, CauseSettings(**settings))


def fill(quotas, *groups):
    for group in groups:
        while quotas.wants(group):
            quotas.take(group)


@pytest.mark.parametrize("total", [6, 7, 100, 301])
def test_parts_add_up_and_are_off_by_less_than_one(total):
    shares = {"a": 0.3, "b": 0.16, "c": 0.18, "d": 0.18, "e": 0.18, "f": 0.0}
    parts = apportion(total, shares)
    assert sum(parts.values()) == total
    assert all(abs(parts[name] - total * share) < 1 for name, share in shares.items())
    assert parts["f"] == 0


@pytest.mark.parametrize("order", [(False, True), (True, False)])
def test_a_split_is_full_when_every_group_is(order):
    wanted = quotas()
    for name, count in {"nominal": 30, "borderline": 16, "noise": 18, "pose": 18, "overlap": 18}.items():
        taken = dict.fromkeys(order, 0)
        for several in order:
            while wanted.wants((name, several)):
                assert not wanted.all_filled()
                wanted.take((name, several))
                taken[several] += 1
        # Whichever kind comes first leaves room for three tenths of the other.
        if name in ("noise", "pose", "overlap"):
            assert list(taken.values()) == [13, 5]
        assert sum(taken.values()) == count
    assert not wanted.wants(("geometry", False))
    assert wanted.all_filled()


def test_without_a_range_either_kind_fills_the_share():
    wanted = quotas(several=(0.0, 1.0))
    fill(wanted, ("noise", True))
    assert wanted._count("noise") == 18
    assert not wanted.wants(("noise", False))


def test_a_candidate_is_wanted_as_long_as_it_can_be():
    wanted = quotas()
    assert wanted.wants_applied(NEITHER)
    fill(wanted, ("nominal", False), ("borderline", False))
    assert not wanted.wants_applied(NEITHER)  # without causes it is neither of the failed
    assert wanted.wants_state("failed", BOTH)
    fill(wanted, ("noise", False), ("noise", True), ("overlap", False))
    assert wanted.wants_state("failed", BOTH)  # by overlap among several
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
        (
            ["noise"],
            "failed from noise; raise causes.severities.noise or causes.severities.outliers, lower causes.poi",
        ),
        (
            ["pose", False],
            "samples that failed from pose alone; raise causes.severities.rotation_deg or causes.severities.translat",
        ),
        (
            ["overlap", True],
            "failed from overlap among several causes; raise causes.severities.crop, widen causes.sev",
        ),
        (
            ["nominal"],
            "nominal samples; lower causes.severities, raise causes.limits.nominal, or move part of causes.shares",
        ),
        (
            ["borderline"],
            "borderline samples; raise success.error, or move part of causes.shares.borderline to anoth",
        ),
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
        tally.count("train", "cup", ("pose", True), kept)
    tally.count("test", "mug", ("no correspondences", False), kept=False)
    tally.save(tmp_path / "tally.csv")
    head, *lines = (tmp_path / "tally.csv").read_text().splitlines()
    assert head == "split,object,group,several,kept,refused"
    assert lines == ["test,mug,no correspondences,0,0,1", "train,cup,pose,1,1,2"]
