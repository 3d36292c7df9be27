"""Predictions of learners for samples like and unlike those of the training, and how far they can be believed."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from gpca.attribution import diagnostics
from gpca.attribution.diagnostics import LEAST_PROBABILITY
from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import source_method_seed
from gpca.io.csv_file import numbers
from gpca.io.frame import Frame
from gpca.pairs.shifted_sets import DISTANCES, TRAINED_ON, ShiftedSets, with_training_like

SCORES = ("max_score", "entropy", "bald", "variance")  # not every learner has the last two


def read_learner_predictions(prediction_files: Iterable[str | Path], set_files: Iterable[str | Path] = ()) -> dict:
    """(source, learner, seed) -> rows of predictions, with uncertainties `SCORES` and `DISTANCES` of the set files."""
    import pandas as pd

    distances = {}
    for path in set_files:
        _, source, seed = source_method_seed(path)
        sets = ShiftedSets.load(path)
        test = sets.split == "test"
        samples = pd.MultiIndex.from_arrays([sets.set[test], sets.sample[test].astype(str)])
        distances[source, seed] = path, pd.DataFrame(sets.distance[test], index=samples, columns=list(DISTANCES))
    predictions = {}
    for path in prediction_files:
        source, learner, seed = source_method_seed(path)
        rows = read_predictions(path, ("set",))
        p_S_C, _ = probabilities(rows)
        if not (p_S_C >= 0).all() or not np.allclose(p_S_C.sum(axis=1), 1, atol=1e-4):
            raise InputError(path, "scores are negative or do not sum to one", "a learner must give probabilities")
        uncertainties = {"max_score": 1 - p_S_C.max(axis=1), "entropy": numbers(path, rows, "entropy")}
        variances = [name for name in rows.columns if name.startswith("variance_")]
        if variances and (rows["bald"] != "").all():
            uncertainties |= {"bald": numbers(path, rows, "bald"), "variance": rows[variances].sum(axis=1)}
        rows = rows.drop(columns="bald").assign(**uncertainties)
        if (source, seed) in distances:
            set_path, measured = distances[source, seed]
            samples = pd.MultiIndex.from_frame(rows[["set", "sample"]])
            if not samples.isin(measured.index).all():
                raise InputError(set_path, f"lacks samples of {path}", "regenerate both from the same config")
            rows = rows.join(measured.loc[samples].set_axis(rows.index))
        predictions[source, learner, seed] = rows
    return predictions


def sets_of(rows: Frame) -> dict[str, Frame]:
    alone = {name: rows[rows["set"] == name] for name in TRAINED_ON if (rows["set"] == name).any()}
    shifted = [name for name in alone if TRAINED_ON[name] != name]
    return alone | {with_training_like(name): rows[rows["set"].isin([name, TRAINED_ON[name]])] for name in shifted}


def probabilities(rows: Frame) -> tuple[np.ndarray, np.ndarray]:
    """p_S_C, and the numbers target_S of the true concepts."""
    concepts = concepts_of(rows)
    target_S = rows["concept_true"].map(concepts.index).to_numpy()
    return rows[[f"score_{concept}" for concept in concepts]].to_numpy(), target_S


def wrong(rows: Frame) -> np.ndarray:
    return ((rows["concept_true"] != rows["concept_predicted"]) | rows["abstained"]).to_numpy()


def scores_of(rows: Frame) -> list[str]:
    return [score for score in SCORES if score in rows]


def estimates_of_scores(rows: Frame, samples: Clustered) -> dict[str, Estimate]:
    """Accuracy, mean confidence, ece, nll and Brier score of the samples, given their rows of predictions."""
    p_S_C, target_S = probabilities(rows)
    p_true_S = np.maximum(p_S_C[np.arange(len(target_S)), target_S], LEAST_PROBABILITY)
    squares_S = np.square(p_S_C - np.eye(p_S_C.shape[1])[target_S]).sum(axis=1)
    return {
        "accuracy": samples.share(~wrong(rows)),
        "confidence": samples.mean(p_S_C.max(axis=1), (0, 1)),
        "ece": samples.over_seeds(
            lambda of, weights_B_n: diagnostics.calibration_error(p_S_C[of], target_S[of], weights_B_n), (0, 1)
        ),
        "nll": samples.mean(-np.log(p_true_S), (0, np.inf)),
        "brier": samples.mean(squares_S, (0, 2)),
    }
