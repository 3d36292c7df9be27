"""Attempts of repair and of rivals, and verdicts by judges and limits of other families."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.errors import InputError
from gpca.experiments.repair import RIVAL, THIRDS, collect, mean_seconds, measured, table20_lead, table20_repair
from gpca.io.csv_file import write_csv
from gpca.reenactment.settings import ReenactmentSettings
from gpca.steps.repair import LIKELIEST, NEVER, REPAIR, TESTS, Attempts, RepairSettings, World, searched, try_all
from gpca.steps.repair_verdicts import CAUSES, HARD, verdicts
from tests.experiments.runs import run_with

TOLERANCE = 0.03
HYPOTHESES = ReenactmentSettings(hypotheses=2)


@pytest.fixture(scope="module")
def ask(causes, four):
    """A function that asks functions about three registrations."""
    tested = causes.subset(causes.rows("test")[:3])
    world = World(tested, {}, four)

    def asked(functions):
        found = lambda pair, _row: searched(pair, HYPOTHESES)  # noqa: E731
        return tested, *try_all(world, RepairSettings(), ICPSettings(), "model", found, ("four", 100), functions)

    return asked


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("pose", "pose by mine: is of type str"),
        (np.eye(4, dtype=complex), "pose by mine: has type complex128"),
        ((np.eye(4), 1.0, 2), "function mine: returns 3 things"),
    ],
)
def test_a_function_returns_a_pose(ask, answer, words):
    with pytest.raises(InputError, match=words):
        ask({"mine": lambda *_: answer})


def test_a_function_stands_beside_the_built_in_rivals(ask, causes):
    truths = iter([causes.registrations.T_target_source("true", row) for row in causes.rows("test")[:3]])
    tested, attempts, seconds = ask({"knows": lambda *_: (next(truths), 2.0), "abstains": lambda *_: None})
    assert attempts.error_N_C[:, 0] == pytest.approx(tested.error_shown)
    *_, knows, abstains = attempts.rivals.error_N_P.T
    assert knows.max() < 1e-3 and abstains.tolist() == pytest.approx(tested.error_shown.tolist())
    assert (attempts.score_N_M_Q[:, -2, TESTS.index("weight")] == -2).all()
    assert (attempts.score_N_M_Q[:, -1] == NEVER).all()
    assert set(seconds["method"]) == {REPAIR, *attempts.method_M} and len(seconds) == 3 * 6


@pytest.mark.parametrize(("answer", "fault"), [(np.zeros((4, 4)), "pose by mine"), ((np.eye(4), "high"), "confidence")])
def test_an_answer_without_sense_is_refused(ask, answer, fault):
    with pytest.raises(InputError, match=fault):
        ask({"mine": lambda *_: answer})


def drawn(seed, families=14, each=24):
    """Attempts with evidence that is mostly right, and two rivals: one whose fitness tells when it is right."""
    random, count = np.random.default_rng(seed), families * each
    error_N_C = np.where(random.random((count, 5)) < 0.5, 0.005, 0.2)
    distance_N_C_K = error_N_C[:, :, None] * random.lognormal(0, 0.5, (count, 5, 2))
    score_N_M_Q = random.random((count, 2, len(TESTS)))
    score_N_M_Q[:, 0, 0] = np.where(error_N_C[:, 3] > TOLERANCE, 0.9, 0.1) + random.normal(0, 0.1, count)
    return Attempts(
        sample_N=np.arange(count),
        group_N=np.full(count, "all"),
        cluster_N=np.repeat([f"family {number}" for number in range(families)], each),
        label_N=np.full(count, "pose"),
        points_N=np.full(count, 300),
        start_error_N=random.random(count),
        error_N_C=error_N_C,
        weight_N_C=np.tile([0, 0.7, 0.3, 0, 0], (count, 1)),
        distance_N_C_K=distance_N_C_K,
        hypothesis_N_C_K=np.tile([0.7, 0.3], (count, 5, 1)),
        inlier_rmse_N_C=np.full((count, 5), 0.02),
        fitness_N_C=np.full((count, 5), 0.9),
        family_N=np.repeat([f"family {number}" for number in range(families)], each),
        score_N_M_Q=score_N_M_Q,
        method_M=np.array(["tells", "guesses"]),
    )


def test_few_of_the_replaced_are_wrong_and_a_rival_needs_a_test():
    rows = verdicts({CAUSES: [("tiny", 0, drawn(0))], HARD: [("tiny", 0, drawn(1))]}, TOLERANCE)
    numbers = measured(rows)
    every = numbers[(numbers["concept"] == "all") & (numbers["against"] == "")]
    values = every.set_index(["source", "method", "metric"])["value"]
    for track in (CAUSES, HARD):
        assert values[track, REPAIR, "repaired"] > 0.5 and values[track, REPAIR, "wrong"] <= 0.06
        assert values[track, "tells", "repaired"] > 0.3 and values[track, "tells", "wrong"] <= 0.08
        assert values[track, "guesses", "repaired"] < 0.05
        assert values[track, "guesses_judged", "repaired"] > 0.3
    lead = numbers[(numbers["against"] == RIVAL) & (numbers["metric"] == "repaired") & (numbers["concept"] == "all")]
    assert set(lead["method"]) == {REPAIR} and set(lead["other"]) == {"tells"} and (lead["value"] > 0).all()


def test_none_wrong_of_a_few_replaced_may_still_be_some():
    rows = verdicts({CAUSES: [("tiny", 0, drawn(0, families=12, each=4))]}, TOLERANCE).assign(right=True)
    numbers = measured(rows).query("metric == 'wrong' and concept == 'all'")
    assert (numbers["value"] == 0).all() and (numbers["high"] > 0.05).all()


def test_the_tested_family_has_no_say_in_its_limits():
    one = drawn(0)
    mine = one.family_N == "family 3"
    spoiled = replace(one, error_N_C=np.where(mine[:, None], 0.2, one.error_N_C))
    before, after = (verdicts({CAUSES: [("tiny", 0, each)]}, TOLERANCE) for each in (one, spoiled))
    decided = [rows.loc[rows["cluster"] == "family 3", "replaced"].tolist() for rows in (before, after)]
    assert decided[0] == decided[1] and any(decided[0])


def test_the_tables_show_every_track_and_part(tmp_path):
    attempts = replace(drawn(0), method_M=np.array([LIKELIEST, "fgr"]))
    rows = verdicts({CAUSES: [("ycb", 0, attempts)]}, TOLERANCE)
    write_csv(tmp_path / "verdicts.csv", rows)
    run = run_with()
    numbers = collect(run, tmp_path / "verdicts.csv")
    seconds = mean_seconds(pd.DataFrame({"method": [REPAIR, "fgr"], "seconds": [0.05, 0.1], "seed": 0}))
    whole, lead = table20_repair(run, numbers, seconds), table20_lead(run, numbers)
    assert whole.printed()["rows"][0][0][0] == "Causes" and len(whole.rows) == 5
    parts = {labels[0][0] for labels in lead.rows}
    assert {"pose", "some", "near", "far"} <= parts and "few" not in parts
    thirds = [row for row, labels in enumerate(lead.rows) if labels[0][0] in THIRDS]
    n_thirds = [lead.cells[row, "lead"].test_samples for row in thirds]
    assert len(thirds) == 3 and max(n_thirds) - min(n_thirds) <= 1
    assert sum(n_thirds) == lead.cells[0, "lead"].test_samples
    assert whole.cells[0, "lead"].mean > 0 and whole.cells[0, "ms"].mean == pytest.approx(50)
