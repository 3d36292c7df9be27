"""Turns predictions for samples like and unlike the training into one tidy table (docs/diagnostics.md)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution import diagnostics
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.experiments.out_of_distribution.sets import DISTANCES, TRAINED_ON, ShiftedSets
from gpca.io.csv_file import numbers
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

TABLE = "learners/"  # `table` of the tidy rows reads this and the set
SCORES = ("max_score", "entropy", "bald", "variance")  # the order of each is judged; not every learner has the last two
RESAMPLES = 200


def with_training_like(shifted: str) -> str:
    """Return the name of a shifted set together with the test samples like the training's of the same encoder."""
    return f"{TRAINED_ON[shifted]}+{shifted}"


def sets_of(rows: pd.DataFrame) -> dict[str, pd.DataFrame]:
    """Return the rows of every set, and of every shifted set together with those that are like the training."""
    alone = {name: rows[rows["set"] == name] for name in TRAINED_ON if (rows["set"] == name).any()}
    together = {
        with_training_like(name): rows[rows["set"].isin([name, TRAINED_ON[name]])]
        for name in alone
        if TRAINED_ON[name] != name
    }
    return alone | together


def read_learner_predictions(prediction_files: Iterable[str | Path], set_files: Iterable[str | Path] = ()) -> dict:
    """Return (source, learner, seed) -> rows of predictions, with the uncertainties `SCORES`, higher where less sure.

    Args:
        prediction_files: named `…/{source}/{learner}/seed{seed}.csv`, as the step ``learners`` writes them.
        set_files: named `…/{source}/seed{seed}.npz`; their `DISTANCES` become columns of the rows.

    Raises:
        InputError: an unusable prediction file, an unknown set, scores that are no probabilities, other samples in
            the two kinds of files.
    """
    distances = {}
    for path in set_files:
        _, source, seed = source_method_seed(path)
        distances[source, seed] = (path, _distances(ShiftedSets.load(path)))
    predictions = {}
    for path in prediction_files:
        source, learner, seed = source_method_seed(path)
        rows = read_predictions(path, ("set",))
        p_S_C = rows[[f"score_{concept}" for concept in concepts_of(rows)]].to_numpy()
        if not (p_S_C >= 0).all() or not np.allclose(p_S_C.sum(axis=1), 1, atol=1e-4):
            raise InputError(path, "scores are negative or do not sum to one", "a learner must give probabilities")
        rows = rows.drop(columns="bald").assign(**_uncertainties(path, rows, p_S_C))
        if (source, seed) in distances:
            other, measured = distances[source, seed]
            keys = _keys(rows)
            if not keys.isin(measured.index).all():
                raise InputError(other, f"lacks samples of {path}", "regenerate both from the same config")
            rows = rows.join(measured.loc[keys].set_axis(rows.index))
        predictions[source, learner, seed] = rows
    return predictions


def collect_diagnostics(prediction_files: Iterable[str | Path], set_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy diagnostics of every source, learner and seed on every set; results/README.md lists them."""
    records = []
    for (source, learner, seed), rows in read_learner_predictions(prediction_files, set_files).items():
        for name, of_set in sets_of(rows).items():
            values = uncertainty_metrics(of_set)
            if "+" not in name:
                values |= probability_metrics(of_set)
            if name == "in_distribution":
                values |= bootstrap_bounds(of_set, source, seed)
            records += [(TABLE + name, source, learner, metric, ALL, seed, float(v)) for metric, v in values.items()]
    return tidy(records, "learners")


def probability_metrics(rows: pd.DataFrame) -> dict[str, float]:
    """Return accuracy, calibration errors, proper scores and the areas under risk and coverage of one set."""
    p_S_C, target_S = probabilities(rows)
    wrong_S = wrong(rows)
    values = {
        "accuracy": np.mean(~wrong_S),
        "confidence": p_S_C.max(axis=1).mean(),
        "ece": diagnostics.calibration_error(p_S_C, target_S),
        "adaptive_ece": diagnostics.calibration_error(p_S_C, target_S, adaptive=True),
        "classwise_ece": diagnostics.classwise_calibration_error(p_S_C, target_S),
        "nll": diagnostics.negative_log_likelihood(p_S_C, target_S),
        "brier": diagnostics.brier_score(p_S_C, target_S),
        "test_samples": len(rows),
    }
    for score in scores_of(rows):
        confidence_S = -rows[score].to_numpy()
        values[f"aurc_{score}"] = diagnostics.aurc(confidence_S, wrong_S)
        values[f"excess_aurc_{score}"] = diagnostics.excess_aurc(confidence_S, wrong_S)
        values[f"augrc_{score}"] = diagnostics.augrc(confidence_S, wrong_S)
    return values


def uncertainty_metrics(rows: pd.DataFrame) -> dict[str, float]:
    """Return Spearman's ρ of every score and every distance."""
    return {
        f"rho_{score}_{distance}": diagnostics.rank_correlation(rows[score], rows[distance])
        for score in scores_of(rows)
        for distance in DISTANCES
    }


def bootstrap_bounds(rows: pd.DataFrame, *axes: object) -> dict[str, float]:
    """Return the bounds `…_low` and `…_high` of one seed's diagnostics: of 95 % of `RESAMPLES` draws of the samples.

    The same draws for all learners, as they are compared.
    """
    p_S_C, target_S = probabilities(rows)
    statistics: dict[str, tuple] = {
        "ece": (diagnostics.calibration_error, p_S_C, target_S),
        "nll": (diagnostics.negative_log_likelihood, p_S_C, target_S),
        "brier": (diagnostics.brier_score, p_S_C, target_S),
    }
    for score in [name for name in scores_of(rows) if name in ("max_score", "bald")]:
        statistics[f"aurc_{score}"] = (diagnostics.aurc, -rows[score].to_numpy(), wrong(rows))
        name = f"rho_{score}_{DISTANCES[0]}"
        statistics[name] = (diagnostics.rank_correlation, rows[score].to_numpy(), rows[DISTANCES[0]].to_numpy())
    bounds: dict[str, float] = {}
    for name, (statistic, *samples) in statistics.items():
        random = generator(*axes, "bootstrap")
        low, high = diagnostics.bootstrap_interval(statistic, *samples, random=random, resamples=RESAMPLES)
        bounds |= {f"{name}_low": low, f"{name}_high": high}
    return bounds


def probabilities(rows: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return p_S_C and the numbers target_S of the true concepts."""
    concepts = concepts_of(rows)
    p_S_C = rows[[f"score_{concept}" for concept in concepts]].to_numpy()
    return p_S_C, rows["concept_true"].map(concepts.index).to_numpy()


def wrong(rows: pd.DataFrame) -> np.ndarray:
    """Return whether each sample was named wrongly, or not at all."""
    return ((rows["concept_true"] != rows["concept_predicted"]) | rows["abstained"]).to_numpy()


def scores_of(rows: pd.DataFrame) -> list[str]:
    """Return those of `SCORES` that the learner has."""
    return [score for score in SCORES if score in rows]


def _uncertainties(path, rows: pd.DataFrame, p_S_C: np.ndarray) -> dict[str, np.ndarray]:
    uncertainties = {"max_score": 1 - p_S_C.max(axis=1), "entropy": numbers(path, rows, "entropy")}
    variances = [name for name in rows.columns if name.startswith("variance_")]
    if variances and (rows["bald"] != "").all():
        uncertainties |= {"bald": numbers(path, rows, "bald"), "variance": rows[variances].sum(axis=1)}
    return uncertainties


def _distances(sets: ShiftedSets) -> pd.DataFrame:
    import pandas as pd

    test = sets.split == "test"
    keys = pd.MultiIndex.from_arrays([sets.set[test], sets.sample[test].astype(str)])
    return pd.DataFrame(sets.distance[test], index=keys, columns=list(DISTANCES))


def _keys(rows: pd.DataFrame) -> pd.MultiIndex:
    import pandas as pd

    return pd.MultiIndex.from_frame(rows[["set", "sample"]])
