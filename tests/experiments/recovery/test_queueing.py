import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.recovery.metrics import DOUBTED, DRAWN, read_queues
from gpca.experiments.recovery.queueing import BATCH, DRAWS, ChancesLearner, error_by_labels
from gpca.experiments.recovery.rehearsal import Rehearsal
from gpca.io.csv_file import write_csv
from gpca.recovery.chances import Trial

COSTS = {"denoise": 0.01, "new_view": 0.02}


class Queued:
    failed = True


@pytest.fixture
def rows():
    """Twelve queued cases of which new_view always helps, four others that it solves too."""
    trials = [[Trial(np.zeros(2), a, a == "new_view") for a in COSTS] for _ in range(12)]
    learners = {"utility": lambda: ChancesLearner(trials, [np.zeros(2)] * 4, COSTS)}
    rehearsal = Rehearsal([Queued()] * 12, dict(enumerate(trials)))
    return error_by_labels(learners, [{"denoise": False, "new_view": True}] * 4, rehearsal, ("tiny", 0))


def test_the_error_falls_with_the_labels_that_are_learned(rows):
    assert set(rows["order"]) == {DOUBTED, DRAWN}
    for _, curve in rows.groupby(["order", "draw"]):
        assert curve["labels"].tolist() == list(range(0, 13, BATCH))
        assert curve["unsolved"].tolist() == [4, 0, 0, 0]  # without a label the cheapest action is taken
    assert len(rows) == (1 + DRAWS) * 4


def test_no_learner_leaves_no_rows():
    assert error_by_labels({}, [], None, ()).empty


def test_seeds_are_pooled_at_the_numbers_that_all_have(rows, tmp_path):
    paths = [tmp_path / f"queue_seed{seed}.csv" for seed in (0, 1)]
    write_csv(paths[0], rows)
    write_csv(paths[1], rows[rows["labels"] < 8].assign(unsolved=2))
    queues = read_queues(paths).set_index(["order", "labels"])
    assert queues.loc[DOUBTED, "error"].tolist() == [6 / 8, 2 / 8]
    assert queues.loc[(DRAWN, 4), "failures"] == 8
    assert (queues["low"] <= queues["error"]).all()
    assert (queues["error"] <= queues["high"]).all()


def test_a_file_without_rows_is_refused(rows, tmp_path):
    write_csv(tmp_path / "queue_seed1.csv", pd.DataFrame(columns=rows.columns))
    with pytest.raises(InputError, match="has no rows"):
        read_queues([tmp_path / "queue_seed1.csv"])
