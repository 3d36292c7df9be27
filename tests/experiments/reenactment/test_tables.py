"""Measures of oracles, their differences from the estimate, and the table of them."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.attribution.predictions import write_predictions
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.judged import CEILING
from gpca.errors import InputError
from gpca.evaluation.measures import POOLED
from gpca.experiments.reenactment.knowledge import EVERYTHING, NOTHING
from gpca.experiments.reenactment.metrics import MEASURED, ORACLE_COLUMNS, collect_oracles, read_oracles
from gpca.experiments.reenactment.tables import table9_oracle
from gpca.io.csv_file import write_csv

SOURCES = {"four": {"title": "Four", "stand_in": True}, "more": {"title": "More", "stand_in": False}}


@pytest.fixture(scope="module")
def files(causes, tmp_path_factory):
    """Who knows nothing always says pose, who knows everything is always right; two sources."""
    folder = tmp_path_factory.mktemp("run")
    label = labels_of(causes.truth)
    right = np.array([[name == each for name in LABELS] for each in label], float) + 0.01
    says = {NOTHING: np.tile([0.1, 0.1, 0.7, 0.1], (len(label), 1)), EVERYTHING: right}
    predictions, truths = [], []
    for source in SOURCES:
        truths.append(folder / "causes" / source / "seed100.npz")
        own = replace(causes, registrations=replace(causes.registrations, axes=(source, 100)))
        own.save(truths[-1])
        for name, scores in says.items():
            predictions.append(folder / "oracles" / source / name / "seed100.csv")
            attribution = Attribution.of_scores(LABELS, scores / scores.sum(axis=1, keepdims=True), seconds=0.0)
            write_predictions(predictions[-1], own.registrations, attribution)
    return predictions, truths


@pytest.fixture(scope="module")
def oracles(files):
    return collect_oracles(*files)


def test_differences_are_those_from_who_knows_nothing_on_the_same_draws(oracles):
    rows = oracles.set_index(["source", "known", "metric"]).sort_index()
    assert set(oracles["source"]) == {*SOURCES, POOLED} and set(oracles["known"]) == {NOTHING, EVERYTHING, CEILING}
    assert list(oracles["metric"].unique()) == list(MEASURED)
    for source in (*SOURCES, POOLED):
        none, every = rows.loc[(source, NOTHING)], rows.loc[(source, EVERYTHING)]
        assert every.loc["balanced_accuracy", "value"] == 1 and every.loc["auroc_failed", "value"] == 1
        assert none["difference"].isna().all()
        for metric in MEASURED:
            apart = every.loc[metric, "value"] - none.loc[metric, "value"]
            assert every.loc[metric, "difference"] == pytest.approx(apart)
        assert every.loc["regret", "difference"] <= 0 < every.loc["balanced_accuracy", "difference"]
        assert np.isfinite(rows.loc[(source, CEILING)]["difference"]).all()


def test_the_file_is_read_as_it_was_written_and_a_hole_in_it_is_named(oracles, tmp_path):
    path = tmp_path / "oracle_intervals.csv"
    write_csv(path, oracles)
    read = read_oracles(path)
    assert read[list(ORACLE_COLUMNS[:3])].equals(oracles[list(ORACLE_COLUMNS[:3])])
    assert read["difference"].to_numpy() == pytest.approx(oracles["difference"].to_numpy(), abs=1e-5, nan_ok=True)
    write_csv(path, oracles.assign(value="much"))
    with pytest.raises(InputError, match=r"oracle_intervals\.csv"):
        read_oracles(path)


def test_the_table_has_a_row_for_all_that_is_known_and_the_ceiling_last(oracles):
    table = table9_oracle(oracles, SOURCES)
    text = table.markdown()
    assert "stand-in" in table.caption
    assert text.index("| All together | nothing: the estimate |") < text.index("| All together | all three |")
    assert text.index("| All together | all three |") < text.index("| All together | Truth from other starts")
    assert text.index("All together") < text.index("Four (procedural stand-in)")
    [record] = [r for r in table.records() if r[:3] == (POOLED, EVERYTHING, "balanced_accuracy")]
    assert record[3] == pytest.approx(100)
    assert (0, "balanced_accuracy_gain") not in table.cells and (1, "balanced_accuracy_gain") in table.cells
    with pytest.raises(InputError, match="has nothing to show"):
        table9_oracle(oracles[oracles["known"] == "other"], SOURCES)
