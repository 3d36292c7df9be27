import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import ALL, write_metrics
from gpca.experiments.real_world.metrics import collect, read_together
from gpca.frames.source import ONE_ENCODER, REAL_WORLD

TRUE = ["noise", "pose", "overlap", "noise"]
NAMED = ["noise", "pose", "noise", "pose"]


def predictions(folder, source, method="dgcnn-none"):
    rows = {"sample": range(4), "split": "test", "object": ["a", "a", "b", "b"], "cluster": "lm 6"}
    rows |= {"concept_true": TRUE, "concept_predicted": NAMED, "abstained": False, "icp_calls": 0}
    rows |= {f"score_{c}": [0.8 if name == c else 0.1 for name in NAMED] for c in ("noise", "pose", "overlap")}
    return written(folder / "predictions" / source / method / "seed0.csv", rows)


def poses(folder, source=REAL_WORLD, **changes):
    rows = {"sample": range(4), "split": "test", "instance": range(4), "dataset": ["lm", "lm", "lm", "ycbv"]}
    rows |= {"in_training": [True, True, False, False]}
    return written(folder / "poses" / source / "seed0.csv", rows | changes)


def written(path, rows):
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def test_seen_unseen_and_datasets_are_judged_apart(tmp_path):
    one = predictions(tmp_path, ONE_ENCODER)
    metrics = collect([predictions(tmp_path, REAL_WORLD)], [poses(tmp_path)], [one])
    accuracy = metrics[(metrics["metric"] == "accuracy") & (metrics["concept"] == ALL)]
    of_table = accuracy[accuracy["source"] == REAL_WORLD].set_index("table")["value"].to_dict()
    assert of_table == {
        "attribution": 0.5, "seen": 1.0, "unseen": 0.0, "dataset/lm": pytest.approx(2 / 3), "dataset/ycbv": 0.0
    }  # fmt: skip
    assert accuracy[accuracy["source"] == ONE_ENCODER]["table"].tolist() == ["attribution"]
    ece = metrics[(metrics["metric"] == "ece") & (metrics["table"] == "seen")]["value"]
    assert ece.tolist() == [pytest.approx(0.2)]
    proper = metrics[metrics["table"] == "unseen"].set_index("metric")["value"]
    assert proper["nll"] == pytest.approx(-np.log(0.1))
    assert proper["brier"] == pytest.approx(0.8**2 + 0.9**2 + 0.1**2)
    write_metrics(metrics, tmp_path / "real_world.csv")
    together = read_together(tmp_path / "real_world.csv")
    assert set(together["table"]) == {"attribution"}
    assert set(together["source"]) == {REAL_WORLD}


def test_files_that_do_not_belong_together_are_refused(tmp_path):
    said = predictions(tmp_path, REAL_WORLD)
    with pytest.raises(InputError, match="has no pose file beside it"):
        collect([said], [poses(tmp_path, source="other")])
    with pytest.raises(InputError, match="lacks samples of"):
        collect([said], [poses(tmp_path, sample=[0, 1, 2, 7])])
