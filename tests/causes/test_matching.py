"""Samples whose trivial numbers know nothing of the dominant cause."""

from collections import Counter

import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression

from benchmarks.hard import fit
from gpca.causes import drawing
from gpca.causes.drawing import GIVEN_AWAY, Matching, draw_causes
from gpca.causes.settings import CauseSettings
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.trivial import TRIVIAL
from tests.conftest import FEW_CAUSES


def candidates(count, random):
    """Trivial numbers of which three give the cause away, one only by its distance from the middle; causes."""
    cause_N = random.choice(CONCEPTS, size=count, p=[0.2, 0.5, 0.3])
    numbers_N_F = random.normal(size=(count, len(TRIVIAL)))
    for column, cause in enumerate(CONCEPTS[:2]):
        numbers_N_F[cause_N == cause, column] += 1.5
    numbers_N_F[cause_N == CONCEPTS[2], 2] *= 3
    return numbers_N_F, cause_N


def known(numbers_N_F, cause_N):
    """Mean share of each cause that is named rightly by logistic regression on the numbers and their squares."""
    features = np.hstack([numbers_N_F, numbers_N_F**2])
    half = len(cause_N) // 2
    named = LogisticRegression(class_weight="balanced", max_iter=500).fit(features[:half], cause_N[:half])
    right = named.predict(features[half:]) == cause_N[half:]
    return np.mean([right[cause_N[half:] == cause].mean() for cause in CONCEPTS])


def test_what_is_accepted_gives_nothing_away(tmp_path):
    random = np.random.default_rng(0)
    fit(*candidates(2000, random)).to_csv(tmp_path / "matching.csv", index=False)
    matching = Matching.load(tmp_path / "matching.csv")
    numbers_N_F, cause_N = candidates(4000, random)
    drawn = zip(numbers_N_F, cause_N, strict=True)
    acceptance_N = np.array([matching.acceptances(numbers_F)[CONCEPTS.index(cause)] for numbers_F, cause in drawn])
    accepted_N = random.random(len(cause_N)) < acceptance_N
    assert known(numbers_N_F, cause_N) > 0.6
    assert known(numbers_N_F[accepted_N], cause_N[accepted_N]) < 0.4
    assert (acceptance_N >= 0).all() and acceptance_N.max() == 1
    shares = [acceptance_N[cause_N == cause].mean() for cause in CONCEPTS]
    assert max(shares) < 1.5 * min(shares)  # alike, whatever the causes' shares among the candidates


def test_candidates_that_give_their_cause_away_are_refused_and_counted(four, monkeypatch):
    class Never:
        def acceptances(self, numbers_10):
            return np.array([1.0, 0.0, 1.0])  # no pose

    monkeypatch.setattr(drawing.Matching, "load", classmethod(lambda cls: Never()))
    settings = CauseSettings(**FEW_CAUSES | {"matched": True, "candidates": 3})
    with pytest.raises(drawing.InputError, match="pose"):
        draw_causes(four, "four", 100, settings)
    counted = Counter()
    made = drawing._Drawing(four, "four", 100, settings)
    made.up_to(60, "train", drawing.Quotas(settings.train, settings))
    for (_, _, group, _, kept), count in made.tally.items():
        counted[group, kept] += count
    assert counted[f"pose{GIVEN_AWAY}", False] and not counted["pose", True] and counted["overlap", True]


def test_what_no_cause_would_let_pass_is_not_measured(four, monkeypatch):
    monkeypatch.setattr(drawing.Matching, "acceptances", lambda self, numbers_10: np.zeros(len(CONCEPTS)))
    monkeypatch.setattr(drawing.Measuring, "truth", None)
    made = drawing._Drawing(four, "four", 100, settings := CauseSettings(**FEW_CAUSES | {"matched": True}))
    assert not made.up_to(12, "train", drawing.Quotas(settings.train, settings))
    assert {group for _, _, group, _, _ in made.tally} <= {f"any{GIVEN_AWAY}", "any", "no correspondences"}


def test_a_failure_has_one_cause_that_adds_more_than_the_margin(four):
    limits = FEW_CAUSES.get("limits", {}) | {"margin": 0.05}
    made = drawing._Drawing(four, "four", 100, settings := CauseSettings.from_dict(FEW_CAUSES | {"limits": limits}))
    records = made.up_to(60, "train", drawing.Quotas(settings.train, settings))
    margins = [each["truth"].margin[0] for each in records if each["truth"].state[0] == "failed"]
    assert margins and min(margins) >= 0.05
    assert any(group.endswith(drawing.TIED) and not kept for _, _, group, _, kept in made.tally)
