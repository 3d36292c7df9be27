"""Scores beside the published rows, and the table that shows them."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.causes.judged import CEILING
from gpca.evaluation.measures import POOLED
from gpca.experiments.diagnosis import collect
from gpca.pairs.perturbation import CONCEPTS
from gpca.tracks.leaderboard import MARK, as_text, table_of
from gpca.tracks.overall import areas, costs_of, overall, ranks
from gpca.tracks.published import Method, Rows
from gpca.tracks.scoring import groups_of, score
from gpca.tracks.track import TRACKS

from .conftest import SEED, SOURCE


def of(rows, **wanted):
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    [row] = rows.to_dict("records")
    return row


@pytest.fixture
def mine(shipped):
    return replace(shipped.methods[0], name="mine", title="Mine")  # as `chance`


def test_published_rows_have_the_numbers_of_the_runs_own_table(shipped, run):
    scores, _ = score(shipped, {})
    files = [run / f"diagnoses/{SOURCE}/{name}/seed{SEED}.csv" for name in ("chance", "rule")]
    _, table = collect(None, files, [run / f"causes/{SOURCE}/seed{SEED}.npz"])
    assert set(scores["method"]) == {"chance", "rule", CEILING}
    for row in table[table["against"] == ""].to_dict("records"):
        own = of(scores, method=row["method"], metric=row["metric"])
        assert (own["value"], own["samples"]) == (pytest.approx(row["value"]), row["samples"])


def test_the_table_ranks_by_the_headline_with_paired_differences_of_the_other_minus_mine(shipped, mine):
    table = table_of(shipped, {"mine": mine}, *score(shipped, {"mine": mine}))
    names = [labels[0][0] for labels in table.rows]
    assert names[0] == "rule" and names[-1] == CEILING and set(names) == {"rule", "chance", "mine", CEILING}
    text = as_text(table)
    [line] = [line for line in text.splitlines() if MARK in line]
    assert line.startswith(f"{MARK}Mine") and "nothing" in line
    assert "Minus Mine (points)" in text and shipped.version in text
    scores, against = score(shipped, {"mine": mine})
    assert set(against["method"]) == {"chance", "rule"}
    same, better = of(against, method="chance"), of(against, method="rule")
    assert same["difference"] == 0
    accuracy = {name: of(scores, method=name, metric="balanced_accuracy")["value"] for name in ("rule", "mine")}
    assert better["difference"] == pytest.approx(accuracy["rule"] - accuracy["mine"]) and better["difference"] > 0
    assert better["difference_low"] <= better["difference"] <= better["difference_high"]


def test_hard_samples_are_scored_by_accuracy_and_by_concept(shipped):
    # The same samples as those of the track `hard`, of which the published method names two thirds rightly.
    rows = replace(shipped.rows, concept=np.resize(CONCEPTS, len(shipped.rows)))
    right_N = np.arange(len(rows)) % len(CONCEPTS)
    named_N = np.where(right_N == 2, 0, right_N)
    scores_N_3 = np.where(named_N[:, None] == np.arange(3), 0.8, 0.1)
    published = Method("rule", "Rule", "pair", 0, scores_N_3, named_N)
    hard = replace(shipped, track=TRACKS["hard"], rows=rows, methods=(published,))
    scores, _ = score(hard, {})
    concept_N = hard.rows.concept
    assert of(scores, metric="accuracy")["value"] == pytest.approx((concept_N != "overlap").mean())
    recalls = {name: of(scores, metric=f"recall_{name}")["value"] for name in CONCEPTS}
    assert recalls == {"noise": 1.0, "pose": 1.0, "overlap": 0.0}
    assert of(scores, metric="accuracy")["group"] == POOLED
    assert "Of overlap (%)" in as_text(table_of(hard, {}, *score(hard, {})))


def test_starts_of_depth_frames_are_scored_by_kind_and_an_instance_counts_once(shipped):
    n = len(shipped.rows)
    start, counted = np.resize(["native", "ladder"], n), np.arange(n) != 0
    rows = replace(shipped.rows, start=start, instance=np.arange(n) // 4, counted=counted)
    frames = replace(shipped, track=TRACKS["frames"], rows=rows)
    groups = {kind: (chosen, draws) for kind, chosen, draws in groups_of(frames)}
    assert set(groups) == {"native", "ladder"}
    assert 0 not in groups["native"][0]
    for chosen, draws in groups.values():
        assert draws.once.sum() == pytest.approx(len(set(rows.instance[chosen])))
    scores, _ = score(frames, {})
    assert set(scores["group"]) == {"native", "ladder"}
    assert "Ladder of errors" in as_text(table_of(frames, {}, *score(frames, {})))


def test_more_starts_of_the_same_instances_make_no_interval_narrower(shipped):
    n, tables = len(shipped.rows), []
    for starts in (1, 3):
        again = np.tile(np.arange(n), starts)
        arrays = {name: array[again] for name, array in shipped.rows.arrays.items()}
        starts_of = {"start": np.full(n * starts, "native"), "instance": again, "scene": again.astype(str)}
        rows = Rows(**arrays | starts_of | {"counted": again >= 0})
        methods = tuple(replace(each, scores=each.scores[again], named=each.named[again]) for each in shipped.methods)
        frames = replace(shipped, track=TRACKS["frames"], rows=rows, methods=methods)
        tables.append(score(frames, {})[0].drop(columns="samples"))
    pd.testing.assert_frame_equal(*tables)


def test_methods_that_are_not_shown_to_be_worse_share_a_rank():
    draws = np.random.default_rng(0).normal(size=501)
    draws[0] = 0
    values = {"best": 0.1 + 0.01 * draws, "alike": 0.105 + 0.01 * draws[::-1], "worse": 0.3 + 0.01 * draws}
    values["alike"][0] = 0.105
    assert ranks(values) == {"best": 1, "alike": 1, "worse": 3}


def test_the_score_of_all_tracks_is_the_risk_of_answers_that_are_not_held_back(shipped):
    found = areas(shipped, {})
    knows, guesses = found["rule"][0], found["chance"][0]
    assert knows == 0 < guesses < 0.5  # a wrong answer to every sample is held back half of the time
    board, [costs] = overall([(shipped, {})], {"rule": "https://rule.org"})
    rows = [row["cells"] for row in board["groups"][""]]
    assert [cells[0]["text"] for cells in rows] == [method.title for method in shipped.methods[::-1]]
    assert [cells[0].get("link") for cells in rows] == ["https://rule.org", None]
    assert rows[0][1]["text"] == "1" and rows[0][2]["drawn"][1] == 0
    # The rule asks for 12 runs of ICP, and chance for none.
    assert [(point["across"], point["best"]) for point in costs] == [(0, True), (pytest.approx(0.371, abs=1e-3), True)]
    methods = {each.name: each for each in shipped.methods}
    points = costs_of(found | {"rule": found["chance"] + 0.1}, {"rule": 12, "chance": 0}, methods)
    assert [point["best"] for point in points] == [True, False]
