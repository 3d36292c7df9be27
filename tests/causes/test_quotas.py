import numpy as np
import pytest

from gpca.causes.quotas import Quotas, Tally, apportion, group_of
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


def test_a_split_is_full_when_every_group_is():
    wanted = quotas()
    counts = {("nominal", False): 30, ("borderline", False): 16, ("geometry", False): 0}
    counts |= {(concept, several): 9 for concept in ("noise", "pose", "overlap") for several in (False, True)}
    for group, count in counts.items():
        for _ in range(count):
            assert not wanted.all_filled()
            assert wanted.wants(group)
            wanted.take(group)
        assert not wanted.wants(group)
    assert wanted.all_filled()


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
            ("noise", False),
            "failed by noise alone; raise causes.severities.noise or causes.severities.outliers, lower",
        ),
        (("pose", True), "failed by pose among several causes; raise causes.severities.rotation_deg or"),
        (
            ("overlap", True),
            "among several causes; raise causes.severities.crop, lower causes.several, or give some of",
        ),
        (
            ("nominal", False),
            "nominal; lower causes.severities, raise causes.limits.nominal, or give some of causes.sh",
        ),
        (
            ("borderline", False),
            "borderline; raise causes.limits.failed, or give some of causes.shares.borderline to an",
        ),
    ],
)
def test_who_gives_up_says_which_group_is_rare_and_what_to_widen(rare, said):
    wanted = quotas()
    fill(wanted, *(group for group in wanted._left if group not in (rare, ("pose", False))))
    wanted.take(("pose", False))  # it is not full either, but has one
    line = str(wanted.refuse_to_go_on("ycb", 3, "train", 2000))
    assert line.startswith("causes of ycb, seed 3, train: 2000 candidates gave 0 of ")
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
