"""Fits the matching of hard samples (gpca/causes/drawing.py), and shows what trivial numbers know after it.

    python benchmarks/hard.py draw objects.npz --seed 100 --candidates 0 1000 --out draws/100_0.npz
    python benchmarks/hard.py fit draws/100_*.npz
    python benchmarks/hard.py check --seed 101 draws/101_*.npz

Candidates are drawn by the config's `controls.hard` without matching, of development objects and seeds. ``check``
accepts those of other seeds by the matching, and prints the balanced accuracy of logistic regression, trees, boosting
and a forest on the ten trivial numbers of what is accepted, fitted to four fifths of it and asked about the rest, all
in turn, by object: no object is learned from and asked about.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from gpca.process.processor import prepare  # noqa: E402

PENALTY = 1.0  # inverse regularization
FOLDS = 5


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("draw", "fit", "check"))
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--candidates", type=int, nargs=2, default=(0, 1000))
    parser.add_argument("--screened", action="store_true")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args(arguments)
    prepare()
    if options.what == "draw":
        numbers_N_F, cause_N, object_N = draw(
            options.files[0], options.seed, range(*options.candidates), options.screened
        )
        np.savez_compressed(options.out, numbers=numbers_N_F, cause=cause_N, object=object_N)
        return
    drawn = [np.load(path) for path in options.files]
    numbers_N_F, cause_N, object_N = (
        np.concatenate([each[of] for each in drawn]) for of in ("numbers", "cause", "object")
    )
    if options.what == "fit":
        fit(numbers_N_F, cause_N).to_csv(
            options.out or ROOT / "gpca/causes/matching.csv", index=False, float_format="%.6g"
        )
    else:
        print(json.dumps(check(numbers_N_F, cause_N, object_N, options.seed)))


def draw(objects_file: Path, seed: int, candidates: range, screened: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return trivial numbers (N, 10), dominant causes and objects of the candidates that failed from one cause.

    Those `screened` leave out what the matching so far accepts in no case.
    """
    from gpca.causes.candidate import Registrar, Unmeasurable, draw_applied, draw_candidate
    from gpca.causes.drawing import ENDS, Matching, group_of, numbers_of, state_of
    from gpca.causes.measuring import Measuring, read_subjects
    from gpca.causes.settings import CauseSettings
    from gpca.causes.truth import FAILED
    from gpca.config.layers import with_defaults
    from gpca.objects.canonical import ObjectClouds
    from gpca.pairs.perturbation import CONCEPTS
    from gpca.seeds import generator

    config = with_defaults()
    settings = CauseSettings.from_dict(config["causes"] | config["controls"]["hard"], config["registrations"]["icp"])
    subjects, measuring, rows = read_subjects(ObjectClouds.load(objects_file)), Measuring(settings, np.inf), []
    matching = Matching.load()
    for number in candidates:
        subject, axes = subjects[number % len(subjects)], (objects_file.stem, seed, "matching", number)
        random = generator(*axes)
        candidate = draw_candidate(subject.surface, draw_applied(settings, random), settings, random)
        registrar = Registrar(candidate, settings)
        measured = measuring.counterfactuals(registrar, subject, axes, "starts")
        try:
            numbers_F = numbers_of(measuring.observed(registrar, subject, axes, most=1))
            if screened and not matching.acceptances(numbers_F).any():
                continue
            if state_of(measuring.truth(measured, ENDS)) == FAILED:
                truth = measuring.truth(measured)
                cause, _ = group_of(truth)
                if cause in CONCEPTS and truth.margin[0] >= settings.limits.margin:
                    rows.append((numbers_F, cause, subject.name))
        except Unmeasurable:
            continue
    numbers, causes, names = zip(*rows, strict=True)
    return np.array(numbers), np.array(causes), np.array(names)


def fit(numbers_N_F: np.ndarray, cause_N: np.ndarray):
    """Return the rows of the file of :class:`gpca.causes.drawing.Matching`."""
    import pandas as pd
    from sklearn.linear_model import LogisticRegression

    from gpca.causes.drawing import TERM_COLUMNS, Matching, terms
    from gpca.pairs.perturbation import CONCEPTS
    from gpca.pairs.trivial import TRIVIAL

    matching = Matching(numbers_N_F.mean(axis=0), numbers_N_F.std(axis=0), np.zeros((3, len(terms()))))
    term_N_T = np.array([matching.expanded(numbers) for numbers in numbers_N_F])
    regression = LogisticRegression(C=PENALTY, max_iter=5000, class_weight="balanced", fit_intercept=False)
    regression.fit(term_N_T, cause_N)
    weights = regression.coef_[[regression.classes_.tolist().index(cause) for cause in CONCEPTS]]
    of_numbers = dict(zip(TRIVIAL, zip(matching.center, matching.scale, strict=True), strict=True))
    rows = [(term, *of_numbers.get(term, ("", "")), *weights[:, i]) for i, term in enumerate(terms())]
    return pd.DataFrame(rows, columns=list(TERM_COLUMNS))


def check(numbers_N_F: np.ndarray, cause_N: np.ndarray, object_N: np.ndarray, seed: int) -> dict[str, float]:
    """Return shares that are accepted by cause, and the balanced accuracies before and after, in %."""
    from sklearn.ensemble import HistGradientBoostingClassifier, RandomForestClassifier
    from sklearn.metrics import balanced_accuracy_score
    from sklearn.model_selection import GroupKFold, cross_val_predict
    from sklearn.tree import DecisionTreeClassifier

    from gpca.causes.drawing import Matching
    from gpca.explainers.classifiers import standardized_regression
    from gpca.pairs.perturbation import CONCEPTS
    from gpca.seeds import generator

    random, matching = generator("matching", seed), Matching.load()
    drawn = zip(numbers_N_F, cause_N, strict=True)
    acceptance_N = np.array([matching.acceptances(numbers_F)[CONCEPTS.index(cause)] for numbers_F, cause in drawn])
    accepted_N = random.random(len(cause_N)) < acceptance_N
    result = {"candidates": len(cause_N), "accepted": int(accepted_N.sum())}
    result |= {f"accepted_{cause}": round(acceptance_N[cause_N == cause].mean(), 3) for cause in CONCEPTS}
    learners = {
        "logistic": standardized_regression(1.0),
        "tree_3": DecisionTreeClassifier(max_depth=3, random_state=0),
        "forest": RandomForestClassifier(300, min_samples_leaf=3, random_state=0),
        "boosting": HistGradientBoostingClassifier(max_leaf_nodes=8, learning_rate=0.05, random_state=0),
    }
    for when, rows in (("before", np.arange(len(cause_N))), ("after", np.flatnonzero(accepted_N))):
        fewest = min((cause_N[rows] == cause).sum() for cause in CONCEPTS)
        even = np.concatenate([rows[cause_N[rows] == cause][:fewest] for cause in CONCEPTS])
        result[f"samples_{when}"] = len(even)
        for name, learner in learners.items():
            folds = GroupKFold(FOLDS).split(even, groups=object_N[even])
            named = cross_val_predict(learner, numbers_N_F[even], cause_N[even], cv=list(folds))
            result[f"{name}_{when}"] = round(100 * balanced_accuracy_score(cause_N[even], named), 1)
    return result


if __name__ == "__main__":
    main()
