"""The file of the paper's sentences: what it holds, and which values each of its comparisons is of."""

from dataclasses import replace
from datetime import date

import numpy as np
import pandas as pd
import pytest
import yaml

from gpca.attribution.predictions import PREDICTION_COLUMNS
from gpca.comparison import claims as claims_file
from gpca.comparison.claims import (
    CLAIM_COLUMNS,
    CLAIMS,
    FIRST_SET,
    PREDICTIONS,
    Claim,
    Compared,
    counterparts_of,
    judge,
    read_claims,
    read_verdicts,
    verdict_of_interval,
)
from gpca.comparison.published import UNITS, read_published
from gpca.comparison.values import ShareDraws, folders_behind
from gpca.evaluation.intervals import Clustered
from gpca.io.structured_text import load_own_yaml

from .conftest import write
from .made_up import ACCURACY, LABELS, OBJECTS, TIME, runtime, tidy
from .test_published import FILES

ENTRY = {
    "name": "best", "sentence": "Ours is best.", "place": "Sec. IV", "test": "greater", "margin": 1, "unit": "%",
    "of": {"in_file": "metrics.csv", "in_table": "attribution", "source": ["ycb", "linemod"], "metric": "accuracy",
           "concept": "all"},
    "comparisons": [{"one": "a", "others": ["b", 50]}],
}  # fmt: skip
OTHER = replace(ACCURACY, methods=("other",))
CLAIM = Claim("best", "Ours is best.", "Sec. IV", "greater", 1.0, "%", compared=(Compared(ACCURACY, OTHER),))


def test_the_file_keeps_the_rules_of_its_head():
    claims = read_claims()
    assert len({claim.name for claim in claims}) == len(claims)
    assert {claim.test for claim in claims} == {"greater", "less", "not_worse", "equivalent", ""}
    for entry in load_own_yaml(CLAIMS):
        assert entry.keys() >= ({"test", "margin", "unit", "of"} if "comparisons" in entry else {"note"}), entry
    for claim in claims:
        assert all((claim.name, claim.sentence, claim.place)), claim
        assert claim.unit in UNITS if claim.compared else claim.note, claim
        assert claim.margin >= claim.ratio, claim
        assert date.fromisoformat(claim.margin_set) >= date.fromisoformat(FIRST_SET), claim
        assert claim.values_known or claim.margin_set > FIRST_SET, claim
        for place in (place for compared in claim.compared for place in compared.counterparts):
            assert place.file in {*FILES, PREDICTIONS}, claim
            assert all((place.table, *place.sources, *place.methods, *place.metrics, place.concept)), claim
    printed = (number.counterpart for number in read_published())
    folders = set(folders_behind([*printed, *counterparts_of(read_claims())]))
    places = [place for place in counterparts_of(read_claims()) if place.file == PREDICTIONS]
    asked = {("predictions", place.sources[0], place.methods[0]) for place in places}
    assert asked
    assert asked <= folders


def test_a_claim_is_compared_in_every_source(tmp_path, monkeypatch):
    path = tmp_path / "claims.yaml"
    path.write_text(yaml.safe_dump([ENTRY]))
    monkeypatch.setattr(claims_file, "CLAIMS", path)
    [claim] = read_claims()
    assert [(c.one.sources, c.one.methods, getattr(c.other, "methods", c.other)) for c in claim.compared] == [
        (("ycb",), ("a",), ("b",)),
        (("linemod",), ("a",), ("b",)),
        (("ycb",), ("a",), 50.0),
        (("linemod",), ("a",), 50.0),
    ]
    assert len(claim.compared[2].counterparts) == 1


def judged(claim, *rows, objects=OBJECTS, **results):
    """Judge one claim on tidy rows of accuracies."""
    files = {"metrics.csv": pd.concat(rows)} if rows else {}
    return judge([claim], {**files, **results}, objects)


def rows_of(*differences, base=0.8):
    """Two methods that differ by so many points in each seed, whatever the seed itself does."""
    seeds = [base + 0.05 * number for number in range(len(differences))]
    return tidy([a + d / 100 for a, d in zip(seeds, differences, strict=True)]), tidy(seeds, method="other")


@pytest.mark.parametrize(
    ("test", "low", "high", "verdict"),
    [
        ("greater", 0.1, 3, "supported"),
        ("greater", -0.1, 3, "inconclusive"),
        ("greater", -3, -0.1, "refuted"),
        ("greater", -0.5, 0.9, "smaller than the margin"),  # not greater by what counts
        ("greater", 0.1, 0.9, "smaller than the margin"),
        ("greater", 0.1, 1.0, "supported"),
        ("less", -0.9, -0.1, "smaller than the margin"),
        ("less", -3, -0.1, "supported"),
        ("less", -3, 0.1, "inconclusive"),
        ("less", 0.1, 3, "refuted"),
        ("not_worse", -0.9, 5, "supported"),
        ("not_worse", -3.0, 0.4, "inconclusive"),  # holds 0, which says nothing
        ("not_worse", -3.0, -1.1, "refuted"),
        ("equivalent", -0.9, 0.9, "supported"),
        ("equivalent", 0.1, 0.9, "supported"),  # differs, but by less than counts
        ("equivalent", -0.5, 1.1, "inconclusive"),
        ("equivalent", 1.1, 2, "refuted"),
        ("equivalent", -2, -1.1, "refuted"),
        ("equivalent", float("nan"), float("nan"), "inconclusive"),
    ],
)
def test_each_verdict_of_each_test(test, low, high, verdict):
    assert verdict_of_interval(replace(CLAIM, test=test), low, high) == verdict


def test_differences_are_those_of_the_same_seed():
    rows = judged(CLAIM, *rows_of(2.0, 2.2, 1.8))
    [row] = rows.itertuples()
    assert tuple(rows.columns) == CLAIM_COLUMNS
    assert (row.value, row.n, row.verdict, row.claim_verdict) == (pytest.approx(2), 3, "supported", "supported")
    assert row.high - row.value == pytest.approx(4.30265 * 0.2 / 3**0.5, rel=1e-4)  # though seeds differ by 5 points
    assert (row.one, row.other) == ("gpca_paper", "other")


def test_every_verdict_on_a_claim():
    def verdict(*differences, **more):
        return judged(CLAIM, *rows_of(*differences), **more)["claim_verdict"][0]

    assert verdict(2.0, 2.2, 1.8) == "supported"
    assert verdict(-2.0, -2.2, -1.8) == "refuted"
    assert verdict(2.0, 2.0, 2.0) == "inconclusive"  # an interval of a share is never of no width
    assert verdict(0.5, 0.51, 0.49) == "smaller than the margin"
    assert verdict(3.0, -2.0, 4.0) == "inconclusive"
    assert verdict(2.0) == "inconclusive"  # one seed
    assert judged(CLAIM)["claim_verdict"][0] == "not run"
    assert judged(replace(CLAIM, compared=(), note="why"))["claim_verdict"][0] == "not run"
    stand_in = {"ycb": {"title": "YCB", "stand_in": True}}
    assert verdict(2.0, 2.2, 1.8, objects=stand_in) == "not comparable"


def test_many_comparisons_do_not_refute_by_chance():
    lower = rows_of(-0.6, -1.1, -1.6, -2.0)  # below zero with 95 %, not with 99 %
    absent = Compared(replace(ACCURACY, methods=("nothing",)), OTHER)
    claim = replace(CLAIM, margin=0.0)
    alone = judged(claim, *lower)
    among_ten = judged(replace(claim, compared=(*CLAIM.compared, *[absent] * 9)), *lower)
    assert alone["claim_verdict"][0] == "refuted"
    assert (among_ten["verdict"][0], among_ten["claim_verdict"][0]) == ("refuted", "inconclusive")
    assert set(among_ten["verdict"][1:]) == {"not run"}


def test_a_number_stands_for_itself_and_of_factors_the_logarithms_are_compared():
    chance = replace(CLAIM, compared=(Compared(ACCURACY, 33.3),))
    [row] = judged(chance, tidy([0.5, 0.51, 0.52])).itertuples()
    assert (row.value, row.other, row.verdict) == (pytest.approx(51 - 33.3), "33.3", "supported")
    claim = replace(CLAIM, test="less", margin=1.25, ratio=True)
    [row] = judged(claim, tidy([0.2, 0.21]), tidy([0.4, 0.42], method="other")).itertuples()
    assert (row.value, row.low, row.high, row.verdict) == (pytest.approx(0.5), 0.5, 0.5, "supported")
    [row] = judged(claim, tidy([0.0, 0.2]), tidy([0.4, 0.4], method="other")).itertuples()
    assert row.verdict == "inconclusive"  # nothing has no logarithm


def labels_of(bald, random, reached_bald=1, reached_random=1):
    """Labels of two strategies by seed, and whether the first seed reached the target."""
    values = {
        ("bald", "labels_to_target"): bald,
        ("random", "labels_to_target"): random,
        ("bald", "reached"): [reached_bald, *bald[1:]],
        ("random", "reached"): [reached_random, *random[1:]],
    }
    table = {"concept": "overlap", "table": "active_learning/pretrained"}
    rows = [tidy(each, method=method, metric=metric, **table) for (method, metric), each in values.items()]
    return {"active_learning.csv": pd.concat(rows)}


FEWER = Claim(
    "fewer", "s", "p", "less", 1.0, "labels", compared=(Compared(replace(LABELS, methods=("bald",)), LABELS),)
)


def test_labels_that_ended_before_the_target_leave_one_answer_open():
    def verdict(*labels, **reached):
        return judged(FEWER, **labels_of(*labels, **reached))["verdict"][0]

    assert verdict([10, 11], [60, 61]) == verdict([10, 11], [60, 61], reached_random=0) == "supported"
    assert verdict([10, 11], [60, 61], reached_bald=0) == "inconclusive"
    assert verdict([60, 61], [10, 11]) == verdict([60, 61], [10, 11], reached_bald=0) == "refuted"
    assert verdict([60, 61], [10, 11], reached_random=0) == "inconclusive"


def test_both_at_the_first_batch_of_labels_say_nothing():
    claim = replace(FEWER, margin=1.25, ratio=True)

    def row(of_bald, of_random, floors):
        [row] = judge([claim], labels_of(of_bald, of_random), OBJECTS, floors=floors).itertuples()
        return row

    first = row([4, 4, 4], [4, 4, 4], {"labels": 4})
    assert (first.verdict, first.at_floor, first.claim_verdict) == ("inconclusive", True, "inconclusive")
    assert row([4, 4, 4], [4, 4, 4], {}).verdict == "smaller than the margin"
    assert row([4, 4, 4], [4, 4, 60], {"labels": 4}).at_floor  # in at least half of the seeds
    apart = row([4, 4, 4], [58, 60, 62], {"labels": 4})
    assert (apart.verdict, apart.at_floor) == ("supported", False)


def test_shares_have_the_farther_bounds_of_seeds_and_clusters():
    samples = Clustered(np.zeros(1), np.zeros(1), np.ones((5, 1)))
    shares = {ACCURACY: np.array([0.75, 0.9, 0.8, 0.7, 0.6]), OTHER: np.full(5, 0.7)}
    draws = {place: ShareDraws(share_B, samples, np.array([True])) for place, share_B in shares.items()}
    alike = {"metrics.csv": pd.concat(rows_of(5.0, 5.0, 5.0))}
    [row] = judge([CLAIM], alike, OBJECTS, clusters=draws).itertuples()
    assert (row.value, row.verdict) == (pytest.approx(5), "inconclusive")
    assert (row.low, row.high) == pytest.approx((-8.5, 18.5), abs=0.8)
    against_number = replace(CLAIM, compared=(Compared(ACCURACY, 50.0), Compared(50.0, ACCURACY)))
    one, other = judge([against_number], alike, OBJECTS, clusters=draws).itertuples()
    assert (one.low, one.high) == pytest.approx((-other.high, -other.low))


def test_times_are_compared_by_their_means_and_scatter():
    compared = (Compared(TIME, replace(TIME, methods=("scores",))),)
    claim = Claim("slow", "s", "p", "greater", 2.0, "s", ratio=True, compared=compared)
    [row] = judged(claim, **{"runtime.csv": runtime(icp=3.0, features=1.0, scores=0.5)}).itertuples()
    assert (row.value, row.n, row.verdict, row.one) == (pytest.approx(8), 100, "supported", "icp+features")
    assert row.low == pytest.approx(8 * 0.976, rel=5e-3)
    assert judged(claim, **{"runtime.csv": runtime(icp=3.0, features=1.0)})["verdict"][0] == "not run"


def test_calibration_comes_from_predictions(tmp_path):
    heads = (*PREDICTION_COLUMNS, "score_noise", "score_pose")
    paths = []
    for method, sure in (("gpca_paper", 0.75), ("other", 0.95)):
        for seed in (100, 101):
            rows = [(i, "test", "a", "a", "noise", "noise" if i < 75 else "pose", False, 0,
                     *((sure, 1 - sure) if i < 75 else (1 - sure, sure))) for i in range(100)]  # fmt: skip
            paths.append(tmp_path / PREDICTIONS / "ycb" / method / f"seed{seed}.csv")
            write(paths[-1], heads, rows)
    place = replace(ACCURACY, file=PREDICTIONS, table="scores", metrics=("ece",))
    compared = (Compared(place, replace(place, methods=("other",))),)
    claim = Claim("calibrated", "s", "p", "less", 0.01, "share", compared=compared)
    [row] = judge([claim], {}, OBJECTS, paths).itertuples()
    assert (row.value, row.verdict) == (pytest.approx(-0.2), "supported")  # three in four are right


def test_verdicts_are_written_and_read(tmp_path):
    claims = [CLAIM, Claim("open", "s", "p", note="nobody ran it")]
    rows = judge(claims, {"metrics.csv": pd.concat(rows_of(2, 3))}, OBJECTS)
    path = tmp_path / "claims.csv"
    rows.to_csv(path, index=False)
    read = read_verdicts(path)
    assert read["value"].tolist() == pytest.approx([2.5, float("nan")], nan_ok=True)
    assert read["verdict"].tolist() == rows["verdict"].tolist()
